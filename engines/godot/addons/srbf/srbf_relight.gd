# SPDX-License-Identifier: MIT
class_name SrbfRelight
extends Node3D
## Lights its surfaces by an asset, and follows Godot's lights.
##
## The node marks the asset's origin, rotation and scale. A light of energy 1 lights a white diffuse surface as Godot's
## own light does: π times its linear color as irradiance, at 1 m from an omni or spot light.
##
## An asset of named lights has its own: `set_light` dims, recolors and switches them, and Godot's lights do nothing.
##
## An asset of lights inside a scene follows whatever lights the scene's surfaces, by Godot's own shadows: see `by_surfels`.

const Z_UP := Transform3D(Basis(Vector3(1, 0, 0), Vector3(0, 0, 1), Vector3(0, -1, 0)), Vector3.ZERO)  # (x, y, z) to (x, -z, y)
const RADIUS := 1e-4  # meters: least distance of a receiver from a light, as in Godot
const SKY_WIDTH := 32
const WINDOW_SKY_WIDTH := 512

@export var asset: SrbfAsset
## Meshes with the asset's texture coordinates as second UV layer, and canvas items; the node's children by default.
@export var surfaces: Array[Node]
## Lights to follow; all of the scene by default.
@export var lights: Array[Light3D]
## An environment map, as in Godot's PanoramaSkyMaterial; it is averaged down to 32 texels of width, 512 where it shines through windows. Bytes are sRGB.
@export var sky: Texture2D
@export var sky_energy := 1.0
## Most omni and spot lights of a shader.
@export_range(1, 64) var most_point_lights := 4
## Eigen maps: read directional lights' weights from the table of omni and spot lights; faster, for lights that move every frame.
@export var suns_by_table := false
## Named lights: intensities by name, 1 as the scene has a light set, which is also what a missing name means. See `set_light`.
@export var intensities := {}
## Named lights: colors by name, as of Godot's lights, on top of the scene's own; white where a name is missing.
@export var colors := {}
## Lights inside a scene, of assets fitted with --editable: linear radiance of objects that emit, by name. See `set_emission`.
@export var emission := {}
## The same: colors of objects with other albedo, by name, as of Godot's materials. See `set_albedo`.
@export var albedo := {}
## Lights inside a scene: draw the direct light of all of Godot's lights, with their shadows, on surfels of the scene. Off: omni and spot lights by a table
## of places, on the CPU, with the bounces of inverse-square light, omni_attenuation 2, over any range. A spot's bounces are then a rough
## approximation: those of a point light at its place with the share of the flux that is inside the cone. In a small room they
## are off by 0.4 for a half-angle of 45°, by 0.6 for 20° (relative rms), where a point light's are off by 0.03.
@export var by_surfels := true
## Draw the surfels in every frame, since objects move; off: when a light or the asset has moved or changed.
@export var surfels_every_frame := true
## So many by so many pixels are drawn of each surfel's cells; assets of transfer have four of these a surfel, so that 1 does.
@export_enum("1:1", "2 x 2:2", "4 x 4:4") var surfel_parts := 2
## Of the surfels' own shadow maps of omni and spot lights, pixels.
@export_range(256, 8192, 256) var surfel_shadow_size := 2048
## For canvas items, in stops.
@export var exposure := 0.0

## The passes of `by_surfels`, where there are any.
var surfel_weights: SrbfSurfelWeights

var _materials: Array[ShaderMaterial] = []
var _weights: ImageTexture
var _environment_weights: PackedVector4Array
var _environment_of := []
var _cells: PackedVector3Array  # radiance of the environment through windows
var _painted := {}
var _last := []
var _warned := {}


func _ready() -> void:
	if asset:
		apply()


## Give the surfaces their materials; call it again after a change of asset or surfaces.
func apply() -> void:
	_materials.clear()
	_last = []
	_painted = {}
	_weights = null
	if surfel_weights:
		surfel_weights.queue_free()
		surfel_weights = null
	_make_materials()
	if asset.surfels and by_surfels:
		surfel_weights = SrbfSurfelWeights.of(asset, surfel_parts, surfel_shadow_size)
		add_child(surfel_weights, false, INTERNAL_MODE_FRONT)
		_give("srbf_weights", surfel_weights.weights)


func _make_materials() -> void:
	var made := {}
	for surface in surfaces if surfaces else get_children():
		if surface is CanvasItem:
			if not made.has("canvas_item"):
				made.canvas_item = _material("canvas_item", "canvas")
			surface.material = made.canvas_item
		elif surface is GeometryInstance3D:
			if not made.has("spatial"):
				made.spatial = _material("spatial", "spatial")
			surface.material_override = made.spatial


## Dim, recolor or switch one of the scene's own lights. `intensity` 1 is as the scene has it set, 0 off; `color` as of Godot's lights.
func set_light(light_name: String, intensity := 1.0, color := Color.WHITE) -> void:
	intensities[light_name] = intensity
	colors[light_name] = color


## Let an object emit, with all bounces: `color` times `energy` is its mean radiance, as of Godot's materials; energy 0 ends it.
func set_emission(object_name: String, energy := 1.0, color := Color.WHITE) -> void:
	var linear := color.srgb_to_linear()
	emission[object_name] = Vector3(linear.r, linear.g, linear.b) * energy


## Repaint an object: bounces off it change everywhere. Its own albedo again: `albedo.erase(NAME)`.
func set_albedo(object_name: String, color: Color) -> void:
	albedo[object_name] = color


## The names that `set_emission` and `set_albedo` take; none where the asset was not fitted with --editable.
func object_names() -> PackedStringArray:
	return asset.surfels.surfaces.names if asset and asset.surfels and asset.surfels.surfaces else PackedStringArray()


## The names that `set_light` takes; none where the asset follows Godot's lights.
func light_names() -> PackedStringArray:
	return asset.light_table.names if asset and asset.light_table else PackedStringArray()


## The materials in use, which hold the albedo of meshes.
func materials() -> Array[ShaderMaterial]:
	return _materials


func _process(_delta: float) -> void:
	if _materials.is_empty():
		return
	var found: Array[Light3D] = lights.duplicate()
	if lights.is_empty():
		found.assign(get_tree().root.find_children("*", "Light3D", true, false))
	found = found.filter(func(light: Light3D) -> bool: return light.is_visible_in_tree())
	var asset_from_godot := asset.asset_from_world * Z_UP * global_transform.affine_inverse()
	var now := [asset_from_godot, exposure, suns_by_table, sky, sky_energy, get_viewport().use_hdr_2d]
	for light in found:
		now.append_array([light.global_transform, light.light_color, light.light_energy, light.light_negative])
		if not light is DirectionalLight3D:
			now.append(SrbfGodotLight.cone(light))
			now.append(SrbfGodotLight.decay(light))
		if surfel_weights:
			now.append_array([light.shadow_enabled, light.light_cull_mask])
			now.append_array([] if light is DirectionalLight3D else [light.get_param(Light3D.PARAM_RANGE)])
	if asset.light_table:
		now.append_array([intensities.duplicate(), colors.duplicate()])
	if asset.surfels:
		now.append_array([emission.duplicate(), albedo.duplicate()])
	var is_changed := now != _last
	_last = now
	if is_changed:
		_follow(found, asset_from_godot)
	if surfel_weights and (surfels_every_frame or is_changed):
		surfel_weights.draw(asset_from_godot)


## What depends on the lights, the node's place, or the exposure.
func _follow(found: Array[Light3D], asset_from_godot: Transform3D) -> void:
	if asset.light_table:
		_give_weights(asset.light_table.weights(_mix()))
	elif surfel_weights:
		_check_lights(found)
		_set_shapes(asset_from_godot)
	elif asset.position_table:
		_give_weights(_cloud_weights(found, asset_from_godot))
	else:
		_set_distant_lights(found, asset_from_godot)
		_set_point_lights(found, asset_from_godot)
	for material in _materials:
		material.set_shader_parameter("srbf_asset_from_world", asset_from_godot)
		material.set_shader_parameter("srbf_exposure", exposure)
		material.set_shader_parameter("srbf_encode", not get_viewport().use_hdr_2d)


func _set_distant_lights(found: Array[Light3D], asset_from_godot: Transform3D) -> void:
	var directions := PackedVector3Array()
	var colors := PackedVector3Array()
	for light in found:
		if light is DirectionalLight3D:
			directions.append((asset_from_godot.basis * light.global_basis.z).normalized())
			colors.append(SrbfGodotLight.irradiance(light))
	var sums := asset.weights(directions, colors, suns_by_table)
	if sky:
		if _is_new_sky(asset_from_godot):
			_environment_weights = SrbfSky.weights(asset, SrbfSky.panorama(sky, SKY_WIDTH), asset_from_godot.basis.orthonormalized())
		for i in sums.size():
			sums[i] += _environment_weights[i] * sky_energy
	if asset.method == "relighting-map":
		_give("srbf_weights", sums)
	else:
		_give_weights(sums)


## A row of weights per cluster, or one row of all maps', as a texture.
func _give_weights(sums: PackedVector4Array) -> void:
	var rows := asset.clusters if asset.scalars else 1
	var image := Image.create_from_data(sums.size() / rows, rows, false, Image.FORMAT_RGBAF, sums.to_byte_array())
	if _weights == null:
		_weights = ImageTexture.create_from_image(image)
		_give("srbf_weights", _weights)
	else:
		_weights.update(image)


## Linear intensity times color of every named light.
func _mix() -> PackedVector3Array:
	for light_name in intensities.keys() + colors.keys():
		if not light_name in asset.light_table.names:
			_warn("expected a light of the asset, found %s; its lights are %s" % [light_name, ", ".join(asset.light_table.names)])
	var mix := PackedVector3Array()
	for light_name in asset.light_table.names:
		var color: Color = colors.get(light_name, Color.WHITE)
		color = color.srgb_to_linear()
		mix.append(Vector3(color.r, color.g, color.b) * float(intensities.get(light_name, 1.0)))
	return mix


## What surfels cannot follow.
func _check_lights(found: Array[Light3D]) -> void:
	if not lights.is_empty():
		_warn("expected no list of lights with by_surfels, found one: all lights count that light_cull_mask does not keep from layer 21")
	for light in found:
		if not light.shadow_enabled:
			_warn("expected shadow_enabled at %s, found none: its bounces are those of light that passes walls" % light.name)


## Omni and spot lights by the table of places. The asset has bounces alone; Godot's light itself, range and shadows included, comes on top.
func _cloud_weights(found: Array[Light3D], asset_from_godot: Transform3D) -> PackedVector4Array:
	var places := PackedVector3Array()
	var strengths := PackedVector3Array()
	var unit := pow(absf(asset_from_godot.basis.determinant()), 1.0 / 3.0)  # the asset's meters per meter of Godot's
	if sky or emission or albedo:
		_warn("expected by_surfels for an environment and for objects that change, found it off; they do nothing")
	for light in found:
		if light is DirectionalLight3D:
			_warn("expected omni and spot lights for a light cloud, found %s; it adds no indirect light" % light.name)
			continue
		if absf(SrbfGodotLight.decay(light) - 2.0) > 0.01:
			_warn("expected attenuation 2 for a light cloud, found %g at %s; its bounces are those of 2" % [SrbfGodotLight.decay(light), light.name])
		var place := asset_from_godot * light.global_position
		if not asset.position_table.sees(place):
			_warn("expected %s in the free space that was captured, found it elsewhere; its bounces are those of the places around" % light.name)
		places.append(place)
		strengths.append(SrbfGodotLight.irradiance(light) * (unit * unit * SrbfGodotLight.flux_share(light)))
	return asset.position_table.weights(places, strengths)


## Once for each text, since lights may move in every frame.
func _warn(text: String) -> void:
	if not _warned.has(text):
		_warned[text] = true
		push_warning(text)


## Objects that emit or are repainted, and an environment through windows.
func _set_shapes(asset_from_godot: Transform3D) -> void:
	var known := object_names()
	for object_name: String in emission.keys() + albedo.keys():
		if not object_name in known:
			_warn("expected an object of %s, found %s" % [", ".join(known) if known else "an asset fitted with --editable", object_name])
	if known:
		surfel_weights.shapes.set_emission(emission)
		if albedo != _painted:
			_painted = albedo.duplicate()
			surfel_weights.shapes.set_albedo(albedo)
	if not asset.surfels.environment:
		if sky:
			_warn("expected an asset whose surfels see an environment, found one without; its scene is closed, or the asset is older: bake and fit again")
		return
	if sky and albedo:
		_warn("expected the albedo of the bake under an environment, found objects that are repainted; its bounces are those of their own albedo")
	if sky and _is_new_sky(asset_from_godot):
		_cells = SrbfSky.cell_radiance(SrbfSky.panorama(sky, WINDOW_SKY_WIDTH), asset_from_godot.basis.orthonormalized(), asset.surfels.environment_side)
	surfel_weights.shapes.set_environment(_cells, sky_energy if sky else 0.0)


## An environment map's weights are the slowest, and change only with it.
func _is_new_sky(asset_from_godot: Transform3D) -> bool:
	var now := [asset, sky, asset_from_godot.basis]
	var is_new := now != _environment_of
	_environment_of = now
	return is_new


func _set_point_lights(found: Array[Light3D], asset_from_godot: Transform3D) -> void:
	var point_lights := PackedVector4Array()
	var unit := pow(absf(asset_from_godot.basis.determinant()), 1.0 / 3.0)  # the asset's meters per meter of Godot's
	for light in found:
		if light is DirectionalLight3D or not asset.position:
			continue
		if point_lights.size() == 4 * most_point_lights:
			push_warning("expected at most %d omni and spot lights, found more; raise most_point_lights" % most_point_lights)
			break
		var squared := SrbfGodotLight.decay(light) >= 1.5
		var place := asset_from_godot * light.global_position
		var color := SrbfGodotLight.irradiance(light) * (unit * unit if squared else unit)
		var axis := -(asset_from_godot.basis * light.global_basis.z).normalized()
		var cone := SrbfGodotLight.cone(light)
		point_lights.append(Vector4(place.x, place.y, place.z, RADIUS * unit))
		point_lights.append(Vector4(0.0, 0.0, 0.0, 1.0 if squared else 0.0))
		point_lights.append(Vector4(color.x, color.y, color.z, cone.x))
		point_lights.append(Vector4(axis.x, axis.y, axis.z, cone.y))
	_give("srbf_point_light_count", point_lights.size() / 4)
	point_lights.resize(4 * most_point_lights)
	_give("srbf_point_lights", point_lights)


func _material(type: String, file: String) -> ShaderMaterial:
	var shader := Shader.new()
	shader.code = "shader_type %s;\n%s#define SRBF_POINT_LIGHTS %d\n#include \"res://addons/srbf/shaders/%s.gdshaderinc\"\n" % [
		type, asset.defines(), most_point_lights, file
	]
	var material := ShaderMaterial.new()
	material.shader = shader
	_materials.append(material)
	var constants := {
		"srbf_layers": asset.layers(),
		"srbf_scale": asset.scale,
		"srbf_bias": asset.bias,
		"srbf_last_level": float(asset.levels - 1),
		"srbf_positions": asset.texture("position"),
		"srbf_ambient": asset.texture("ambient"),
		"srbf_alpha": asset.texture("coverage") if asset.is_picture else null,
	}
	if asset.is_weighted():
		constants.srbf_clusters = asset.texture("cluster_index")
	elif asset.method == "relighting-map":
		var centers := PackedVector4Array()
		for center in asset.centers:
			centers.append(Vector4(center.x, center.y, center.z, 0.0))
		constants.srbf_centers = centers
		constants.srbf_table = asset.texture("r_table")
	else:
		constants.srbf_table = asset.texture("w_table")
		constants.srbf_table_size = asset.w_table_size
		constants.srbf_clusters = asset.texture("cluster_index")
	for name in constants:
		if constants[name] != null:
			material.set_shader_parameter(name, constants[name])
	return material


func _give(name: StringName, value: Variant) -> void:
	for material in _materials:
		material.set_shader_parameter(name, value)
