# SPDX-License-Identifier: MIT
class_name SrbfProbes
extends SrbfRelight
## Lights objects that move by an asset of probes, under the lights that SrbfRelight follows; `surfaces` are the objects, in the asset's rooms.
##
## The light of all probes is drawn into a small texture in every frame. Objects get a material of this node, or call `srbf_probe_light_at` of
## shaders/probe_lit.gdshaderinc in a shader of their own: see `light_material`.

## Nine harmonics of the light of every node, in seven texels each.
var light: Texture2D
## Of the facets of the probes, and of the harmonics.
var viewports: Array[SubViewport] = []

var _facets: ShaderMaterial


## Give the objects their materials; call it again after a change of asset or surfaces.
func apply() -> void:
	for viewport in viewports:
		viewport.queue_free()
	viewports.clear()
	if asset.probes == null:
		push_error("expected an asset of probes, found one of %s; SrbfRelight lights surfaces" % ("a view" if asset.is_view else "a lightmap"))
		return
	super()
	var facets := _pass(Vector2i(asset.width, asset.height), _facets)
	var harmonics := ShaderMaterial.new()
	harmonics.shader = preload("shaders/probe_harmonics.gdshader")
	harmonics.set_shader_parameter("srbf_facets", facets)
	harmonics.set_shader_parameter("srbf_probe_places", ImageTexture.create_from_image(asset.probes.places))
	harmonics.set_shader_parameter("srbf_probe_weights", SrbfProbeGrid.facet_weights())
	harmonics.set_shader_parameter("srbf_size", asset.probes.light_size())
	light = _pass(asset.probes.light_size(), harmonics)
	for material in _materials:
		_light(material)


## Give a shader material that includes probe_lit.gdshaderinc the light of the probes; it follows the node from then on.
func light_material(material: ShaderMaterial) -> void:
	_light(material)
	_materials.append(material)
	_last = []


func _make_materials() -> void:
	_facets = _material("canvas_item", "probe_facets")
	for surface in surfaces if surfaces else get_children():
		if surface is GeometryInstance3D:
			if _materials.size() == 1:
				_material("spatial", "probe_spatial")
			surface.material_override = _materials[1]


func _light(material: ShaderMaterial) -> void:
	material.set_shader_parameter("srbf_probe_light", light)
	var uniforms := asset.probes.uniforms()
	for name in uniforms:
		material.set_shader_parameter(name, uniforms[name])


func _pass(size: Vector2i, material: ShaderMaterial) -> Texture2D:
	var viewport := SrbfSurfelWeights.pass_of(size, material)
	viewport.render_target_update_mode = SubViewport.UPDATE_ALWAYS
	add_child(viewport, false, INTERNAL_MODE_FRONT)
	viewports.append(viewport)
	return viewport.get_texture()
