# SPDX-License-Identifier: MIT
@tool
class_name SrbfProbeGrid
extends Resource
## A regular grid of probes in free space: the nodes, and what shaders need to mix their light without leaks through walls.

const FACETS := 12
const HARMONICS := 9
const TEXELS := 7  # of a node's harmonics: 27 numbers by four

## Meters, in the asset's frame.
@export var origin: Vector3
@export var spacing := 1.0
@export var counts: Vector3i
## Columns x, rows z Y + y: x, y, z of each node's probe, and the number of the node whose light it has.
@export var places: Image
## Octahedral tiles of 1 / distance to the surfaces around, one a probe.
@export var nearness: Image


static func read(folder: String, receiver: Dictionary) -> SrbfProbeGrid:
	var grid := SrbfProbeGrid.new()
	grid.origin = Vector3(receiver.origin[0], receiver.origin[1], receiver.origin[2])
	grid.spacing = receiver.spacing
	grid.counts = Vector3i(receiver.counts[0], receiver.counts[1], receiver.counts[2])
	grid.places = SrbfAsset.image(folder, receiver.places)
	grid.nearness = SrbfAsset.image(folder, receiver.nearness)
	if grid.places == null or grid.nearness == null:
		return null
	grid.places.convert(Image.FORMAT_RGBAF)
	grid.nearness.convert(Image.FORMAT_RH)
	return grid


## Pixels of a texture of all nodes' harmonics.
func light_size() -> Vector2i:
	return Vector2i(TEXELS * counts.x, counts.y * counts.z)


## Uniforms of probe_lit.gdshaderinc that stay, by name.
func uniforms() -> Dictionary:
	return {
		"srbf_probe_places": ImageTexture.create_from_image(places),
		"srbf_probe_nearness": ImageTexture.create_from_image(nearness),
		"srbf_probe_grid": Vector4(origin.x, origin.y, origin.z, spacing),
		"srbf_probe_counts": counts,
	}


## How much of the irradiance on facet f is radiance of harmonic k: 9 f + k. The facets are a spherical 5-design.
static func facet_weights() -> PackedFloat32Array:
	var weights := PackedFloat32Array()
	for normal in facets():
		var values := harmonics(normal)
		for k in HARMONICS:
			var lobe := PI if k == 0 else PI * 2.0 / 3.0 if k < 4 else PI / 4.0
			weights.append(4.0 * PI / FACETS * values[k] / lobe)
	return weights


## The vertices of an icosahedron.
static func facets() -> PackedVector3Array:
	var golden := (1.0 + sqrt(5.0)) / 2.0
	var normals := PackedVector3Array()
	for turn in 3:
		for a in [-1.0, 1.0]:
			for b in [-golden, golden]:
				var vertex := [Vector3(0.0, a, b), Vector3(b, 0.0, a), Vector3(a, b, 0.0)][turn] as Vector3
				normals.append(vertex.normalized())
	return normals


## Real, degree by degree, m from -l to l, without the Condon-Shortley phase.
static func harmonics(d: Vector3) -> PackedFloat32Array:
	return PackedFloat32Array([
		0.2820947918, 0.4886025119 * d.y, 0.4886025119 * d.z, 0.4886025119 * d.x,
		1.0925484306 * d.x * d.y, 1.0925484306 * d.y * d.z, 0.3153915653 * (3.0 * d.z * d.z - 1.0),
		1.0925484306 * d.x * d.z, 0.5462742153 * (d.x * d.x - d.y * d.y),
	])
