# SPDX-License-Identifier: MIT
class_name SrbfSurfelLayout
extends RefCounted
## The pixels of each surface cell in a small render target: in the tile of 32 x 32 pixels where an orthographic camera of the whole scene sees the cell.
##
## Forward+ culls lights per tile, so a cell must lie in its own tile.

const TILE := 32  # pixels
const MOST_TILES := 64  # along a side
const MARGIN := 0.01  # of the scene's size

## Pixels.
var size := Vector2i(TILE, TILE)
## The middle of the scene, in the frame of the node: x to the right, y up, z towards the camera.
var view := Transform3D.IDENTITY
## Meters that the target is high, and that the scene is deep.
var height := 1.0
var depth := 1.0
## Squares of the cells, one mesh for each tile: UV are clip coordinates, UV2.x is 2 π / area.
var meshes: Array[ArrayMesh] = []
## Of every cell: its first pixel, from the top left, and its share of the patch's area.
var cells: Image

var _tile := 1.0  # meters
var _parts: int


## `parts` x `parts` pixels for each cell.
static func of(surfels: SrbfSurfels, parts: int) -> SrbfSurfelLayout:
	var layout := SrbfSurfelLayout.new()
	layout._parts = parts
	var box := AABB(upright(surfels.places[0]), Vector3.ZERO)
	for place in surfels.places:
		box = box.expand(upright(place))
	layout._look(box.grow(MARGIN * maxf(box.get_longest_axis_size(), 1e-3)))
	layout._tile = layout._longest(box) * (1.0 + 2.0 * MARGIN)
	var capacity := (TILE / parts) ** 2
	var owners := layout._owners(surfels, box)
	while _most(owners) > capacity and maxi(layout.size.x, layout.size.y) < MOST_TILES * TILE:
		layout._tile /= 2.0
		owners = layout._owners(surfels, box)
	layout._fill(surfels, owners, capacity)
	return layout


## From the asset's frame to Godot's, y up.
static func upright(vector: Vector3) -> Vector3:
	return Vector3(vector.x, vector.z, -vector.y)


## The camera looks along the shortest side of the scene.
func _look(box: AABB) -> void:
	var along := box.get_shortest_axis_index()
	var z := Vector3.ZERO
	z[along] = 1.0
	var x := Vector3.ZERO
	x[(along + 1) % 3] = 1.0
	view = Transform3D(Basis(x, z.cross(x), z), box.get_center())
	depth = box.size[along]


func _longest(box: AABB) -> float:
	return maxf(absf(view.basis.x.dot(box.size)), absf(view.basis.y.dot(box.size)))


## The tile of each cell, x fastest, y up.
func _owners(surfels: SrbfSurfels, box: AABB) -> PackedInt32Array:
	var extent := Vector2(absf(view.basis.x.dot(box.size)), absf(view.basis.y.dot(box.size)))
	var tiles := Vector2i((extent * (1.0 + MARGIN) / _tile).ceil()).max(Vector2i.ONE)
	size = tiles * TILE
	height = tiles.y * _tile
	var local := view.affine_inverse()
	var owners := PackedInt32Array()
	for place in surfels.places:
		var at := local * upright(place)
		var tile := Vector2i((Vector2(at.x, at.y) / _tile + Vector2(tiles) / 2.0).floor()).clamp(Vector2i.ZERO, tiles - Vector2i.ONE)
		owners.append(tile.y * tiles.x + tile.x)
	return owners


static func _most(owners: PackedInt32Array) -> int:
	var counts := {}
	var most := 0
	for owner in owners:
		counts[owner] = counts.get(owner, 0) + 1
		most = maxi(most, counts[owner])
	return most


func _fill(surfels: SrbfSurfels, owners: PackedInt32Array, capacity: int) -> void:
	var across := size.x / TILE
	var own := {}
	for cell in owners.size():
		own.get_or_add(owners[cell], []).append(cell)
	var pixels := PackedFloat32Array()
	pixels.resize(4 * owners.size())
	for tile: int in own:
		var first := Vector2i(tile % across, tile / across) * TILE
		var listed: Array = own[tile]
		if listed.size() > capacity:
			push_error("expected at most %d surfels in one tile, found %d; lower surfel_parts" % [capacity, listed.size()])
			listed.resize(capacity)
		var places := PackedVector3Array()
		var normals := PackedVector3Array()
		var clip := PackedVector2Array()
		var most := PackedVector2Array()
		var indices := PackedInt32Array()
		for slot in listed.size():
			var cell: int = listed[slot]
			var at := first + Vector2i(slot % (TILE / _parts), slot / (TILE / _parts)) * _parts
			pixels[4 * cell] = at.x
			pixels[4 * cell + 1] = size.y - at.y - _parts
			_add_square(surfels, cell, places, normals)
			for corner in [Vector2i(0, 0), Vector2i(0, _parts), Vector2i(_parts, _parts), Vector2i(_parts, 0)]:
				clip.append(Vector2(at + corner) / Vector2(size) * 2.0 - Vector2.ONE)
				most.append(Vector2(TAU / maxf(surfels.areas[cell], 1e-12), 0.0))
			for corner in [0, 1, 2, 0, 2, 3]:
				indices.append(4 * slot + corner)
		var arrays := []
		arrays.resize(Mesh.ARRAY_MAX)
		arrays[Mesh.ARRAY_VERTEX] = places
		arrays[Mesh.ARRAY_NORMAL] = normals
		arrays[Mesh.ARRAY_TEX_UV] = clip
		arrays[Mesh.ARRAY_TEX_UV2] = most
		arrays[Mesh.ARRAY_INDEX] = indices
		var mesh := ArrayMesh.new()
		mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays)
		meshes.append(mesh)
	_list(surfels, pixels)


## The corners of a square of the cell's area.
func _add_square(surfels: SrbfSurfels, cell: int, places: PackedVector3Array, normals: PackedVector3Array) -> void:
	var place := upright(surfels.places[cell])
	var normal := upright(surfels.normals[cell])
	var tangent := normal.cross(Vector3.UP if absf(normal.y) < 0.9 else Vector3.RIGHT).normalized()
	var half := sqrt(surfels.areas[cell]) / 2.0
	tangent *= half
	var bitangent := normal.cross(tangent)
	for corner in [-tangent - bitangent, -tangent + bitangent, tangent + bitangent, tangent - bitangent]:
		places.append(place + corner)
		normals.append(normal)


func _list(surfels: SrbfSurfels, pixels: PackedFloat32Array) -> void:
	for patch in surfels.patch_count():
		var area := 0.0
		for cell in range(surfels.starts[patch], surfels.starts[patch + 1]):
			area += surfels.areas[cell]
		for cell in range(surfels.starts[patch], surfels.starts[patch + 1]):
			pixels[4 * cell + 2] = surfels.areas[cell] / maxf(area, 1e-30)
	var width := ceili(sqrt(surfels.count()))
	var rows := ceili(float(surfels.count()) / width)
	pixels.resize(4 * width * rows)
	cells = Image.create_from_data(width, rows, false, Image.FORMAT_RGBAF, pixels.to_byte_array())
