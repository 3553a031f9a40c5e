# SPDX-License-Identifier: MIT
# Renders the asset of a project under the lights of jobs.json, to a file of floats for each: run by scripts/test_godot.py.
extends SceneTree


func _initialize() -> void:
	var asset: SrbfAsset = load("res://asset.srbf")
	for job in JSON.parse_string(FileAccess.get_file_as_string("res://jobs.json")):
		await _run(asset, job)
	quit()


func _run(asset: SrbfAsset, job: Dictionary) -> void:
	var viewport := SubViewport.new()
	viewport.size = Vector2i(asset.width, asset.height)
	viewport.own_world_3d = true
	viewport.use_hdr_2d = job.hdr
	viewport.render_target_update_mode = SubViewport.UPDATE_ALWAYS
	var relight := SrbfRelight.new()
	relight.asset = asset
	relight.suns_by_table = job.by_table
	relight.by_surfels = false
	for name in job.mix:
		var color: Array = job.mix[name][1]
		relight.set_light(name, job.mix[name][0], Color(color[0], color[1], color[2]))
	if job.sky:
		var rows := PackedFloat32Array(job.sky).to_byte_array()
		relight.sky = ImageTexture.create_from_image(Image.create_from_data(16, 8, false, Image.FORMAT_RGBF, rows))
		relight.sky_energy = 0.7
	relight.transform = str_to_var(job.transform)
	for light in job.lights:
		relight.lights.append(_light(light))
	if job.mode == "canvas":
		var canvas := ColorRect.new()
		canvas.size = viewport.size
		relight.add_child(canvas)
	else:
		relight.add_child(_square(asset))
		viewport.add_child(_camera(job))
	if job.mode == "white":
		relight.asset = null  # Godot's own light on Godot's own material
	viewport.add_child(relight)
	for light in relight.lights:
		viewport.add_child(light)
	root.add_child(viewport)
	for frame in 4:
		await process_frame
	await RenderingServer.frame_post_draw
	var image := viewport.get_texture().get_image()
	print("%s %s: image format %d" % [job.mode, job.name, image.get_format()])
	image.convert(Image.FORMAT_RGBAF)
	FileAccess.open("res://%s" % job.output, FileAccess.WRITE).store_buffer(image.get_data())
	viewport.queue_free()
	await process_frame


func _light(values: Dictionary) -> Light3D:
	var light: Light3D = ClassDB.instantiate(values.kind)
	for name in values:
		if name != "kind":
			light.set(name, str_to_var(values[name]))
	return light


## The asset's square as two triangles, its corners where an affine position map has them.
func _square(asset: SrbfAsset) -> MeshInstance3D:
	var corners := PackedVector3Array()
	var places := PackedVector2Array([Vector2(0, 0), Vector2(1, 0), Vector2(1, 1), Vector2(0, 1)])
	var origin := _point(asset, 0, 0)
	var right := (_point(asset, asset.width - 1, 0) - origin) / (asset.width - 1)
	var down := (_point(asset, 0, asset.height - 1) - origin) / (asset.height - 1)
	for place in places:
		corners.append(origin + right * (place.x * asset.width - 0.5) + down * (place.y * asset.height - 0.5))
	var arrays := []
	arrays.resize(Mesh.ARRAY_MAX)
	arrays[Mesh.ARRAY_VERTEX] = corners
	var up := down.cross(right).normalized()
	arrays[Mesh.ARRAY_NORMAL] = PackedVector3Array([up, up, up, up])
	arrays[Mesh.ARRAY_TEX_UV2] = places
	arrays[Mesh.ARRAY_INDEX] = PackedInt32Array([0, 1, 2, 0, 2, 3])
	var instance := MeshInstance3D.new()
	instance.mesh = ArrayMesh.new()
	var white := StandardMaterial3D.new()
	white.diffuse_mode = BaseMaterial3D.DIFFUSE_LAMBERT
	white.specular_mode = BaseMaterial3D.SPECULAR_DISABLED
	instance.material_override = white
	instance.mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays)
	return instance


func _point(asset: SrbfAsset, column: int, row: int) -> Vector3:
	var color := asset.position.get_pixel(column, row)
	return Vector3(color.r, color.b, -color.g)


func _camera(job: Dictionary) -> Camera3D:
	var camera := Camera3D.new()
	camera.projection = Camera3D.PROJECTION_ORTHOGONAL
	camera.size = job.size
	camera.transform = str_to_var(job.camera)
	camera.environment = Environment.new()
	camera.environment.ambient_light_source = Environment.AMBIENT_SOURCE_DISABLED
	return camera
