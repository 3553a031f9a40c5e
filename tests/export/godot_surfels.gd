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
	var canvas := ColorRect.new()
	canvas.size = viewport.size
	relight.add_child(canvas)
	viewport.add_child(_scene(asset))
	viewport.add_child(relight)
	for values in job.lights:
		viewport.add_child(_light(values))
	root.add_child(viewport)
	for frame in FRAMES:
		await process_frame
	await RenderingServer.frame_post_draw
	_write(viewport, job.output)
	_write(relight.surfel_weights.viewports[1], "received_" + job.output)
	viewport.queue_free()
	await process_frame


func _light(values: Dictionary) -> Light3D:
	var light: Light3D = ClassDB.instantiate(values.kind)
	for name in values:
		if name != "kind":
			light.set(name, str_to_var(values[name]))
	return light


## The asset's own geometry, where it is in the world.
func _scene(asset: SrbfAsset) -> Node3D:
	var document := GLTFDocument.new()
	var state := GLTFState.new()
	document.append_from_file(ProjectSettings.globalize_path("res://asset/scene.glb"), state)
	var scene: Node3D = document.generate_scene(state)
	for mesh in scene.find_children("*", "MeshInstance3D", true, false):
		mesh.cast_shadow = GeometryInstance3D.SHADOW_CASTING_SETTING_DOUBLE_SIDED
	var upright := SrbfSurfelWeights.UP
	scene.transform = upright * asset.asset_from_world.affine_inverse() * upright.affine_inverse()
	return scene


func _write(viewport: SubViewport, output: String) -> void:
	var image := viewport.get_texture().get_image()
	image.convert(Image.FORMAT_RGBAF)
	FileAccess.open("res://%s" % output, FileAccess.WRITE).store_buffer(image.get_data())
