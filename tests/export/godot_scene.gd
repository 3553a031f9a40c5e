# SPDX-License-Identifier: MIT
# Nodes of scripts/test_godot_surfels.py and scripts/test_godot_probes.py.
extends RefCounted


## An asset's own geometry, where it is in the world; glass casts no shadow.
static func scene(asset: SrbfAsset, path: String) -> Node3D:
	var document := GLTFDocument.new()
	var state := GLTFState.new()
	document.append_from_file(ProjectSettings.globalize_path(path), state)
	var made: Node3D = document.generate_scene(state)
	for mesh in made.find_children("*", "MeshInstance3D", true, false):
		var opaque := not "Pane" in mesh.name
		mesh.cast_shadow = GeometryInstance3D.SHADOW_CASTING_SETTING_DOUBLE_SIDED if opaque else GeometryInstance3D.SHADOW_CASTING_SETTING_OFF
	var upright := SrbfSurfelWeights.UP
	made.transform = upright * asset.asset_from_world.affine_inverse() * upright.affine_inverse()
	return made


## A light by the properties of its node.
static func light(values: Dictionary) -> Light3D:
	var made: Light3D = ClassDB.instantiate(values.kind)
	for name in values:
		if name != "kind":
			made.set(name, str_to_var(values[name]))
	return made
