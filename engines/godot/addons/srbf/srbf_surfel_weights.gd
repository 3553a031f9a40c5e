# SPDX-License-Identifier: MIT
class_name SrbfSurfelWeights
extends Node
## Computes the weights of lights inside a scene on the GPU, without readback: a small viewport draws the cells of the surfaces, lit and shadowed by Godot's own
## lights, and further viewports multiply their irradiance by the asset's tables.

const LAYER := 1 << 20  # the first that no inspector shows: cameras of a scene leave it out
const SCENE_LAYERS := (1 << 20) - 1  # whose objects cast shadows
const PART := 64  # columns that one pixel of a pass adds up
const UP := Transform3D(Basis(Vector3(1, 0, 0), Vector3(0, 0, -1), Vector3(0, 1, 0)), Vector3.ZERO)  # the asset's z up to Godot's y

## The weights, as the shaders of the asset take them.
var weights: Texture2D
var viewports: Array[SubViewport] = []
## The weights of environments and of emissive objects, and changed albedo; null for an asset without.
var shapes: SrbfShapeWeights

var _layout: SrbfSurfelLayout
var _camera: Camera3D
var _squares: Array[MeshInstance3D] = []
var _material: ShaderMaterial
var _first: ShaderMaterial  # of the asset's first table
var _own_table: Texture2D


## `parts` x `parts` pixels a cell; `shadow_size`: of the atlas of the viewport's own shadow maps, pixels.
static func of(asset: SrbfAsset, parts: int, shadow_size: int) -> SrbfSurfelWeights:
	var made := SrbfSurfelWeights.new()
	if asset.surfels.surfaces or asset.surfels.environment:
		made.shapes = SrbfShapeWeights.of(asset.surfels)
		made.add_child(made.shapes)  # drawn first
	made._layout = SrbfSurfelLayout.of(asset.surfels, parts)
	made._add_squares(parts, shadow_size)
	made._add_passes(asset, parts)
	return made


## Follow the asset's place in the world; draw again.
func draw(asset_from_godot: Transform3D) -> void:
	var world_from_cells := asset_from_godot.affine_inverse() * UP.affine_inverse()
	var unit := pow(absf(world_from_cells.basis.determinant()), 1.0 / 3.0)  # Godot's meters per meter of the asset's
	for square in _squares:
		square.global_transform = world_from_cells
	_material.set_shader_parameter("srbf_area_unit", 1.0 / (unit * unit))
	var view := world_from_cells * _layout.view
	var depth := _layout.depth * unit
	_camera.global_transform = Transform3D(view.basis.orthonormalized(), view.origin + view.basis.z.normalized() * depth)
	_camera.size = _layout.height * unit
	_camera.near = 0.4 * depth
	_camera.far = 4.0 * depth  # directional shadows fade out before
	if shapes:
		_first.set_shader_parameter("srbf_table", shapes.table if shapes.table else _own_table)
		shapes.draw()
	for viewport in viewports:
		viewport.render_target_update_mode = SubViewport.UPDATE_ONCE


func _add_squares(parts: int, shadow_size: int) -> void:
	var viewport := _add(viewport_of(_layout.size))
	viewport.positional_shadow_atlas_size = shadow_size
	viewport.positional_shadow_atlas_16_bits = false
	viewport.mesh_lod_threshold = 0.0
	_camera = Camera3D.new()
	_camera.projection = Camera3D.PROJECTION_ORTHOGONAL
	_camera.cull_mask = LAYER | SCENE_LAYERS
	_camera.environment = Environment.new()
	_camera.environment.background_mode = Environment.BG_COLOR
	_camera.environment.background_color = Color.BLACK
	_camera.environment.ambient_light_source = Environment.AMBIENT_SOURCE_DISABLED
	_camera.environment.reflected_light_source = Environment.REFLECTION_SOURCE_DISABLED
	_camera.attributes = CameraAttributesPractical.new()
	viewport.add_child(_camera)
	_material = ShaderMaterial.new()
	_material.shader = preload("shaders/surfel_irradiance.gdshader")
	_material.set_shader_parameter("srbf_parts", float(parts * parts))
	for mesh in _layout.meshes:
		var square := MeshInstance3D.new()
		square.mesh = mesh
		square.layers = LAYER
		square.cast_shadow = GeometryInstance3D.SHADOW_CASTING_SETTING_OFF
		square.gi_mode = GeometryInstance3D.GI_MODE_DISABLED
		square.material_override = _material
		viewport.add_child(square)
		_squares.append(square)


func _add_passes(asset: SrbfAsset, parts: int) -> void:
	var surfels := asset.surfels
	var numbers := _pass(preload("shaders/surfel_means.gdshader"), _square(surfels.patch_count()), {
		"srbf_irradiance": viewports[0].get_texture(),
		"srbf_cells": ImageTexture.create_from_image(_layout.cells),
		"srbf_starts": ImageTexture.create_from_image(_ranges(surfels)),
		"srbf_parts": parts,
	})
	for i in surfels.tables.size():
		var rows := surfels.rows[i]
		var blocks := ceili(float(surfels.columns[i]) / PART)
		var table := ImageTexture.create_from_image(surfels.tables[i])
		numbers = _pass(preload("shaders/table_sums.gdshader"), _square(rows * blocks), {
			"srbf_table": table,
			"srbf_numbers": numbers,
			"srbf_scale": surfels.scales[i],
			"srbf_gray": surfels.tables[i].get_format() == Image.FORMAT_RH,
			"srbf_columns": surfels.columns[i],
			"srbf_rows": rows,
			"srbf_blocks": blocks,
		})
		if i == 0:
			_own_table = table
			if shapes:
				shapes.own_table = table
			_first = viewports[-1].get_child(0).material
		var is_last := i == surfels.tables.size() - 1
		var size := Vector2i(rows / asset.clusters, asset.clusters) if is_last else _square(rows)
		var values := {"srbf_numbers": numbers, "srbf_blocks": blocks}
		if i == 0 and shapes:
			values["srbf_added"] = shapes.added
		numbers = _pass(preload("shaders/block_sums.gdshader"), size, values)
	weights = numbers


func _pass(shader: Shader, size: Vector2i, values: Dictionary) -> Texture2D:
	return _add(pass_by(shader, size, values)).get_texture()


## Godot draws viewports in the order of the tree.
func _add(viewport: SubViewport) -> SubViewport:
	add_child(viewport)
	viewports.append(viewport)
	return viewport


## A viewport of half floats that a shader fills, with the uniforms of `values`.
static func pass_by(shader: Shader, size: Vector2i, values: Dictionary) -> SubViewport:
	var material := ShaderMaterial.new()
	material.shader = shader
	material.set_shader_parameter("srbf_size", size)
	for name in values:
		material.set_shader_parameter(name, values[name])
	return pass_of(size, material)


## A viewport of half floats that draws one canvas item.
static func pass_of(size: Vector2i, material: ShaderMaterial) -> SubViewport:
	var viewport := viewport_of(size)
	viewport.disable_3d = true
	viewport.transparent_bg = true  # keeps all four channels
	var rect := ColorRect.new()
	rect.size = size
	rect.material = material
	viewport.add_child(rect)
	return viewport


static func viewport_of(size: Vector2i) -> SubViewport:
	var viewport := SubViewport.new()
	viewport.size = size
	viewport.use_hdr_2d = true
	viewport.gui_disable_input = true
	viewport.render_target_update_mode = SubViewport.UPDATE_DISABLED
	return viewport


## Sides of a texture of `count` texels that is about as high as wide.
static func _square(count: int) -> Vector2i:
	var width := maxi(2, ceili(sqrt(count)))
	return Vector2i(width, maxi(2, ceili(float(count) / width)))


static func _ranges(surfels: SrbfSurfels) -> Image:
	var size := _square(surfels.patch_count())
	var values := PackedFloat32Array()
	values.resize(2 * size.x * size.y)
	for patch in surfels.patch_count():
		values[2 * patch] = surfels.starts[patch]
		values[2 * patch + 1] = surfels.starts[patch + 1]
	return Image.create_from_data(size.x, size.y, false, Image.FORMAT_RGF, values.to_byte_array())
