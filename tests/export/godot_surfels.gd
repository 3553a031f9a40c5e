# SPDX-License-Identifier: MIT
# Lights the scene of a project by the lights of jobs.json, in the scene's own geometry, and writes the picture of its asset as floats for each, and the
# light on its surfels: run by scripts/test_godot.py.
extends SceneTree

const FRAMES := 4


func _initialize() -> void:
	var asset: SrbfAsset = load("res://asset.srbf")
	for job in JSON.parse_string(FileAccess.get_file_as_string("res://jobs.json")):
		await _run(asset, job)
	quit()


func _run(asset: SrbfAsset, job: Dictionary) -> void:
	var viewport := SubViewport.new()
	viewport.size = Vector2i(asset.width, asset.height)
	viewport.own_world_3d = true
	viewport.use_hdr_2d = true
	viewport.render_target_update_mode = SubViewport.UPDATE_ALWAYS
	var relight := SrbfRelight.new()
	relight.asset = asset
	relight.surfel_parts = job.parts
	relight.surfels_every_frame = false
	if job.panorama:
		relight.sky = ImageTexture.create_from_image(Image.create_from_data(16, 8, false, Image.FORMAT_RGBF, PackedFloat32Array(job.panorama).to_byte_array()))  # words: ok
		relight.sky_energy = job.energy  # words: ok
	for name in job.emission:
		relight.set_emission(name, 5.0, Color.WHITE)  # others first, since passes are drawn when these change
	for name in job.albedo:
		relight.set_albedo(name, Color.WHITE)
	var canvas := ColorRect.new()
	canvas.size = viewport.size
	relight.add_child(canvas)
	viewport.add_child(preload("res://godot_scene.gd").scene(asset, "res://asset/scene.glb"))
	viewport.add_child(relight)
	for values in job.lights:
		viewport.add_child(preload("res://godot_scene.gd").light(values))
	root.add_child(viewport)
	for frame in FRAMES:
		await process_frame
	for name in job.emission:
		relight.set_emission(name, job.emission[name][0], _color(job.emission[name][1]))
	for name in job.albedo:
		relight.set_albedo(name, _color(job.albedo[name]))
	for frame in FRAMES:
		await process_frame
	await RenderingServer.frame_post_draw
	_write(viewport, job.output)
	_write(relight.surfel_weights.viewports[1], "received_" + job.output)
	viewport.queue_free()
	await process_frame


func _write(viewport: SubViewport, output: String) -> void:
	var image := viewport.get_texture().get_image()
	image.convert(Image.FORMAT_RGBAF)
	FileAccess.open("res://%s" % output, FileAccess.WRITE).store_buffer(image.get_data())


static func _color(numbers: Array) -> Color:
	return Color(numbers[0], numbers[1], numbers[2])
