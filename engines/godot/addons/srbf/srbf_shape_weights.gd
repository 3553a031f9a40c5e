# SPDX-License-Identifier: MIT
class_name SrbfShapeWeights
extends Node
## What lights add to the weights of a transfer asset's shapes without light on its surfels, objects that emit and an environment; and the asset's table where
## objects have other albedo. Products of small matrices, in small viewports: those of albedo are drawn when it changes.

## Column 0: what is added to the weight of every shape.
var added: Texture2D
## The table from irradiance on surfels to weights of the shapes, over its scale, with other albedo; null with that of the bake.
var table: Texture2D

var _surfels: SrbfSurfels
var _numbers := {}  # what changes, by name: small textures
var _often: Array[SubViewport] = []
var _seldom: Array[SubViewport] = []
var _emitting: Array[ShaderMaterial] = []  # that read the series, and the feedback
var _changed: Array[Texture2D] = []  # series, feedback
var _repainted: Texture2D
var _is_new := false


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


## Colors of objects with other albedo, by name.
func set_albedo(painted: Dictionary) -> void:
	var surfaces := _surfels.surfaces
	var is_painted := not painted.is_empty() and surfaces.terms > 0
	_is_new = is_painted
	table = _repainted if is_painted else null
	if is_painted:
		_fill("albedo", surfaces.repainted(painted), surfaces.albedo)
	_emitting[0].set_shader_parameter("srbf_left", _changed[0] if is_painted else _texture(surfaces.series))
	_emitting[0].set_shader_parameter("srbf_scale", 1.0 if is_painted else surfaces.scales.series)
	_emitting[1].set_shader_parameter("srbf_left", _changed[1] if is_painted else _texture(surfaces.feedback))
	_emitting[1].set_shader_parameter("srbf_scale", 1.0 if is_painted else surfaces.scales.feedback)


func draw() -> void:
	for viewport in _often + (_seldom if _is_new else []):
		viewport.render_target_update_mode = SubViewport.UPDATE_ONCE
	_is_new = false


func _add_albedo() -> void:
	var own := _surfels.surfaces
	var rank := own.feedback.get_width()
	_numbers.albedo = _list(own.albedo.size())
	_fill("albedo", own.albedo, own.albedo)
	var square := Vector2i(rank, rank)
	var feedback := _product(square, {
		"srbf_left": _texture(own.gather), "srbf_right": _texture(own.sent), "srbf_count": own.albedo.size(), "srbf_scale": own.scales.gather * own.scales.sent,
		"srbf_added": _texture(own.feedback), "srbf_added_scale": own.scales.feedback, "srbf_by_albedo": true, "srbf_albedo": _numbers.albedo,
	}, _seldom)
	var one := Image.create_empty(rank, rank, false, Image.FORMAT_RGBAH)
	for i in rank:
		one.set_pixel(i, i, Color.WHITE)
	var power := feedback
	var sum: Texture2D = _texture(one)
	for bit in range(_bits(own.terms) - 2, -1, -1):  # one + f + f² + … of twice as many terms, or one more: hundreds take few passes
		sum = _product(square, {"srbf_left": power, "srbf_right": sum, "srbf_count": rank, "srbf_added": sum}, _seldom)
		power = _product(square, {"srbf_left": power, "srbf_right": power, "srbf_count": rank}, _seldom)
		if own.terms >> bit & 1:
			sum = _product(square, {"srbf_left": feedback, "srbf_right": sum, "srbf_count": rank, "srbf_added": _texture(one)}, _seldom)
			power = _product(square, {"srbf_left": feedback, "srbf_right": power, "srbf_count": rank}, _seldom)
	_changed = [sum, feedback]
	_repainted = _pass(preload("shaders/repainted_table.gdshader"), Vector2i(_surfels.columns[0], rank), {
		"srbf_table": _texture(_surfels.tables[0]), "srbf_before": _texture(own.series), "srbf_after": sum, "srbf_gather": _texture(own.gather),
		"srbf_albedo": _numbers.albedo, "srbf_before_scale": own.scales.series, "srbf_scale": own.scales.gather / _surfels.scales[0],
	}, _seldom)


## Sum over k of feedback^k first: first + feedback (series first).
func _add_emission() -> void:
	var own := _surfels.surfaces
	var rank := own.feedback.get_width()
	_numbers.radiances = _list(own.names.size())
	var column := Vector2i(2, rank)
	var first := _product(column, {
		"srbf_left": _texture(own.emission), "srbf_right": _numbers.radiances, "srbf_count": own.names.size(), "srbf_scale": own.scales.emission,
	}, _often)
	var reflected := _product(column, {"srbf_right": first, "srbf_count": rank}, _often)
	added = _product(column, {"srbf_right": reflected, "srbf_count": rank, "srbf_added": first}, _often)
	for viewport: SubViewport in _often.slice(-2):
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
	added = _product(Vector2i(2, _surfels.environment.get_height()), values, _often)


func _product(size: Vector2i, values: Dictionary, listed: Array[SubViewport]) -> Texture2D:
	return _pass(preload("shaders/matrix_product.gdshader"), size, values, listed)


func _pass(shader: Shader, size: Vector2i, values: Dictionary, listed: Array[SubViewport]) -> Texture2D:
	var viewport := SrbfSurfelWeights.pass_by(shader, size, values)
	add_child(viewport)
	listed.append(viewport)
	return viewport.get_texture()


## RGB numbers in column 0, or others in column 1 too.
func _fill(name: String, numbers: PackedVector3Array, others := PackedVector3Array()) -> void:
	var values := PackedFloat32Array()
	for i in numbers.size():
		var other := others[i] if others else Vector3.ZERO
		values.append_array([numbers[i].x, numbers[i].y, numbers[i].z, 1.0, other.x, other.y, other.z, 1.0])
	(_numbers[name] as ImageTexture).update(Image.create_from_data(2, numbers.size(), false, Image.FORMAT_RGBAF, values.to_byte_array()))


static func _list(count: int) -> ImageTexture:
	return ImageTexture.create_from_image(Image.create_empty(2, count, false, Image.FORMAT_RGBAF))


static func _texture(image: Image) -> ImageTexture:
	return ImageTexture.create_from_image(image)


static func _bits(number: int) -> int:
	var bits := 0
	while number >> bits:
		bits += 1
	return bits
