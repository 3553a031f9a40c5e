# SPDX-License-Identifier: MIT
class_name SrbfShapeWeights
extends Node
## Computes on the GPU the weights that emissive objects and an environment add to the shapes of a transfer asset, and the asset's table for changed albedo.
## Each is a chain of products of small matrices, in small viewports that are drawn when their input has changed.

const SMALLEST := Vector2i(2, 2)  # pixels of a viewport

## Column 0: the weight to be added for every shape.
var added: Texture2D
## The table from irradiance on surfels to weights of the shapes, divided by its scale, for changed albedo; null with the albedo of the bake.
var table: Texture2D
## The table of the bake, a texture of SrbfSurfelWeights.
var own_table: Texture2D

var _surfels: SrbfSurfels
var _numbers := {}  # what changes, by name: small textures
var _filled := {}  # what these hold
var _adding: Array[SubViewport] = []  # of emission and the environment
var _repainting: Array[SubViewport] = []  # of albedo
var _unmade: Array[Array] = []  # size and uniforms of each of `_repainting`, until the first object is repainted
var _emitting: Array[ShaderMaterial] = []  # that read the series, and the feedback
var _changed: Array[Texture2D] = []  # series, feedback
var _repainted: Texture2D
var _has_new_numbers := true
var _has_new_albedo := false


static func of(surfels: SrbfSurfels) -> SrbfShapeWeights:
	var made := SrbfShapeWeights.new()
	made._surfels = surfels
	if surfels.surfaces:
		made._add_albedo()
		made._add_emission()
	if surfels.environment:
		made._add_environment()
	return made


## Linear radiance of objects, by name.
func set_emission(radiances: Dictionary) -> void:
	var names := _surfels.surfaces.names
	var listed := PackedVector3Array()
	for name in names:
		listed.append(radiances.get(name, Vector3.ZERO))
	_fill("radiances", listed)


## Radiance of every cell of the octahedral map of directions, times `energy`.
func set_environment(cells: PackedVector3Array, energy: float) -> void:
	var seen := PackedVector3Array()
	for cell in _surfels.environment_cells:
		seen.append(cells[cell] * energy if cells else Vector3.ZERO)
	_fill("cells", seen)


## Colors of the objects whose albedo has changed, by name.
func set_albedo(painted: Dictionary) -> void:
	var surfaces := _surfels.surfaces
	var is_painted := not painted.is_empty() and surfaces.terms > 0
	_has_new_albedo = is_painted
	_has_new_numbers = true
	table = _repainted if is_painted else null
	if is_painted:
		_make_repainting()
		_fill("albedo", surfaces.repainted(painted), surfaces.albedo)
	_emitting[0].set_shader_parameter("srbf_left", _changed[0] if is_painted else _texture(surfaces.series))
	_emitting[0].set_shader_parameter("srbf_scale", 1.0 if is_painted else surfaces.scales.series)
	_emitting[1].set_shader_parameter("srbf_left", _changed[1] if is_painted else _texture(surfaces.feedback))
	_emitting[1].set_shader_parameter("srbf_scale", 1.0 if is_painted else surfaces.scales.feedback)


## Redraw in the next frame what has changed.
func draw() -> void:
	if _has_new_albedo:
		_redraw(_repainting)
	if _has_new_numbers:
		_redraw(_adding)
	_has_new_albedo = false
	_has_new_numbers = false


static func _redraw(viewports: Array[SubViewport]) -> void:
	for viewport in viewports:
		viewport.render_target_update_mode = SubViewport.UPDATE_ONCE


func _add_albedo() -> void:
	var own := _surfels.surfaces
	var rank := own.feedback.get_width()
	_numbers.albedo = _list(own.albedo.size())
	var feedback := _repainting_pass(preload("shaders/matrix_product.gdshader"), Vector2i(rank, rank), {
		"srbf_left": own.gather, "srbf_right": own.sent, "srbf_count": own.albedo.size(), "srbf_scale": own.scales.gather * own.scales.sent,
		"srbf_added": own.feedback, "srbf_added_scale": own.scales.feedback, "srbf_by_albedo": true, "srbf_albedo": _numbers.albedo,
	})
	var sum := _sum_of_powers(feedback, rank, own.terms)
	_changed = [sum, feedback]
	_repainted = _repainting_pass(preload("shaders/repainted_table.gdshader"), Vector2i(_surfels.columns[0], rank), {
		"srbf_table": _surfels.tables[0], "srbf_before": own.series, "srbf_after": sum, "srbf_gather": own.gather,
		"srbf_albedo": _numbers.albedo, "srbf_before_scale": own.scales.series, "srbf_scale": own.scales.gather / _surfels.scales[0],
	})


## one + f + f² + …: of n terms 2n by sum + power sum, or n + 1 by one + feedback sum. Hundreds of terms take few passes.
func _sum_of_powers(feedback: Texture2D, rank: int, terms: int) -> Texture2D:
	var identity := Image.create_empty(rank, rank, false, Image.FORMAT_RGBAH)
	for i in rank:
		identity.set_pixel(i, i, Color.WHITE)
	var one: Texture2D = _texture(identity)
	var sum := one
	var power := feedback
	var steps := _doublings(terms)
	for step in steps.size():
		var left := power if steps[step] else feedback
		sum = _repainting_product(rank, {"srbf_left": left, "srbf_right": sum, "srbf_added": sum if steps[step] else one})
		if step + 1 < steps.size():
			power = _repainting_product(rank, {"srbf_left": left, "srbf_right": power})
	return sum


## Sum over k of feedback^k first: first + feedback (series first).
func _add_emission() -> void:
	var own := _surfels.surfaces
	var rank := own.feedback.get_width()
	_numbers.radiances = _list(own.names.size())
	var column := Vector2i(2, rank)
	var first := _product(column, {
		"srbf_left": _texture(own.emission), "srbf_right": _numbers.radiances, "srbf_count": own.names.size(), "srbf_scale": own.scales.emission,
	})
	var reflected := _product(column, {"srbf_right": first, "srbf_count": rank})
	added = _product(column, {"srbf_right": reflected, "srbf_count": rank, "srbf_added": first})
	for viewport: SubViewport in _adding.slice(-2):
		_emitting.append(viewport.get_child(0).material)
	set_albedo({})


func _add_environment() -> void:
	var count := _surfels.environment_cells.size()
	_numbers.cells = _list(count)
	var values := {
		"srbf_left": _texture(_surfels.environment), "srbf_right": _numbers.cells, "srbf_count": count, "srbf_scale": _surfels.environment_scale,
	}
	if added:
		values.srbf_added = added
	added = _product(Vector2i(2, _surfels.environment.get_height()), values)


func _product(size: Vector2i, values: Dictionary) -> Texture2D:
	var viewport := SrbfSurfelWeights.pass_by(preload("shaders/matrix_product.gdshader"), size, values)
	add_child(viewport)
	_adding.append(viewport)
	return viewport.get_texture()


func _repainting_product(rank: int, values: Dictionary) -> Texture2D:
	values.srbf_count = rank
	return _repainting_pass(preload("shaders/matrix_product.gdshader"), Vector2i(rank, rank), values)


## A pass that gets its size, its uniforms and its textures when the first object is repainted. It enters the tree now, because Godot draws viewports in the
## order in which they entered it.
func _repainting_pass(shader: Shader, size: Vector2i, values: Dictionary) -> Texture2D:
	var viewport := SrbfSurfelWeights.pass_by(shader, SMALLEST, {})
	add_child(viewport)
	_repainting.append(viewport)
	_unmade.append([size, values])
	return viewport.get_texture()


func _make_repainting() -> void:
	var textures := {_surfels.tables[0]: own_table}
	for i in _unmade.size():
		var size: Vector2i = _unmade[i][0]
		var values: Dictionary = _unmade[i][1]
		var rect: ColorRect = _repainting[i].get_child(0)
		var material: ShaderMaterial = rect.material
		_repainting[i].size = size
		rect.size = size
		material.set_shader_parameter("srbf_size", size)
		for name: String in values:
			if values[name] is Image and not textures.has(values[name]):
				textures[values[name]] = _texture(values[name])
			material.set_shader_parameter(name, textures.get(values[name], values[name]))
	_unmade.clear()


## RGB numbers in column 0, or others in column 1 too.
func _fill(name: String, numbers: PackedVector3Array, others := PackedVector3Array()) -> void:
	var now := [numbers, others]
	if _filled.get(name) == now:
		return
	_filled[name] = now
	_has_new_numbers = true
	var values := PackedFloat32Array()
	for i in numbers.size():
		var other := others[i] if others else Vector3.ZERO
		values.append_array([numbers[i].x, numbers[i].y, numbers[i].z, 1.0, other.x, other.y, other.z, 1.0])
	(_numbers[name] as ImageTexture).update(Image.create_from_data(2, numbers.size(), false, Image.FORMAT_RGBAF, values.to_byte_array()))


static func _list(count: int) -> ImageTexture:
	return ImageTexture.create_from_image(Image.create_empty(2, count, false, Image.FORMAT_RGBAF))


static func _texture(image: Image) -> ImageTexture:
	return ImageTexture.create_from_image(image)


## How the sum of `terms` powers is made of the first: a step doubles the terms where true, and adds one where false.
static func _doublings(terms: int) -> Array[bool]:
	var steps: Array[bool] = []
	while terms > 1:
		if terms % 2 == 1:
			steps.push_front(false)
		steps.push_front(true)
		terms /= 2
	return steps
