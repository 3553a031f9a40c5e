# SPDX-License-Identifier: MIT
# Draws planes through rooms that the probes of a project light, and writes their pixels and those of the facets as floats: run by scripts/test_godot_probes.py.
extends SceneTree

const PLANES := 2  # layer of the planes, which Godot's own lights leave out


func _initialize() -> void:
	var asset: SrbfAsset = load("res://asset.srbf")
	for job in JSON.parse_string(FileAccess.get_file_as_string("res://jobs.json")):
		await _run(asset, job)
	quit()


func _run(asset: SrbfAsset, job: Dictionary) -> void:
	var viewport := SubViewport.new()
	viewport.size = Vector2i(job.width, job.height)
	viewport.own_world_3d = true
	viewport.use_hdr_2d = true
	viewport.render_target_update_mode = SubViewport.UPDATE_ALWAYS
	var probes := SrbfProbes.new()
	probes.asset = asset
	var plane := _plane(job)
	probes.add_child(plane)
	viewport.add_child(preload("res://godot_scene.gd").scene(asset, "res://asset/scene.glb"))
	viewport.add_child(probes)
	viewport.add_child(_camera(job))
	for values in job.lights:
		var light: Light3D = preload("res://godot_scene.gd").light(values)
		light.light_cull_mask = SrbfSurfelWeights.LAYER | 1
		viewport.add_child(light)
	root.add_child(viewport)
	for frame in 4:
		await process_frame
	await RenderingServer.frame_post_draw
	_write(viewport, job.output)
	_write(probes.viewports[0], "facets_" + job.output)
	viewport.queue_free()
	await process_frame


func _plane(job: Dictionary) -> MeshInstance3D:
	var frame: Transform3D = str_to_var(job.frame)
	var normal: Vector3 = str_to_var(job.normal)
	var corners := PackedVector3Array()
	for corner in [Vector3(-0.5, -0.5, 0.0), Vector3(-0.5, 0.5, 0.0), Vector3(0.5, 0.5, 0.0), Vector3(0.5, -0.5, 0.0)]:
		corners.append(frame * (corner * Vector3(job.across, job.along, 1.0)))
	var arrays := []
	arrays.resize(Mesh.ARRAY_MAX)
	arrays[Mesh.ARRAY_VERTEX] = corners
	arrays[Mesh.ARRAY_NORMAL] = PackedVector3Array([normal, normal, normal, normal])
	arrays[Mesh.ARRAY_INDEX] = PackedInt32Array([0, 1, 2, 0, 2, 3])
	var instance := MeshInstance3D.new()
	instance.mesh = ArrayMesh.new()
	instance.mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays)
	instance.layers = PLANES
	instance.cast_shadow = GeometryInstance3D.SHADOW_CASTING_SETTING_OFF
	return instance


func _camera(job: Dictionary) -> Camera3D:
	var frame: Transform3D = str_to_var(job.frame)
	var camera := Camera3D.new()
	camera.projection = Camera3D.PROJECTION_ORTHOGONAL
	camera.size = job.along
	camera.cull_mask = PLANES
	camera.transform = frame.translated_local(Vector3(0.0, 0.0, 0.5))
	camera.far = 2.0
	camera.environment = Environment.new()
	camera.environment.ambient_light_source = Environment.AMBIENT_SOURCE_DISABLED
	return camera


func _write(viewport: SubViewport, output: String) -> void:
	var image := viewport.get_texture().get_image()
	image.convert(Image.FORMAT_RGBAF)
	FileAccess.open("res://%s" % output, FileAccess.WRITE).store_buffer(image.get_data())
