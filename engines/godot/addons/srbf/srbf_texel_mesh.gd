# SPDX-License-Identifier: MIT
@tool
class_name SrbfTexelMesh
extends RefCounted
## A mesh through the covered texels of an asset's position map, for assets without a mesh.


## At most about `most` vertices, with second UV layer, normals and triangles, in Godot's frame. Triangles with an edge longer than `longest` times
## the median edge span two charts, and are left out.
static func of(asset: SrbfAsset, longest := 4.0, most := 65536) -> ArrayMesh:
	if asset.position == null:
		push_error("expected a position map in the asset, found none: it has no mesh")
		return null
	var step := maxi(1, ceili(sqrt(float(asset.width) * asset.height / most)))
	var columns := _steps(asset.width, step)
	var rows := _steps(asset.height, step)
	var across := columns.size()
	var points := PackedVector3Array()
	var normals := PackedVector3Array()
	var places := PackedVector2Array()
	var covered := PackedByteArray()
	for row in rows:
		for column in columns:
			points.append(asset.point(Vector2i(column, row)))
			normals.append(SrbfAsset.to_godot(asset.normal.get_pixel(column, row)) if asset.normal else Vector3.UP)
			places.append(Vector2((column + 0.5) / asset.width, (row + 0.5) / asset.height))
			covered.append(1 if not asset.coverage or asset.coverage.get_pixel(column, row).r >= 0.5 else 0)
	var lengths := PackedFloat32Array()
	for corner in points.size() - 1:
		if covered[corner] and covered[corner + 1] and (corner + 1) % across:
			lengths.append(points[corner].distance_to(points[corner + 1]))
	lengths.sort()
	var limit := longest * lengths[lengths.size() / 2] if lengths else INF
	var indices := PackedInt32Array()
	for row in rows.size() - 1:
		for column in across - 1:
			var corner := row * across + column
			for triangle in [[corner, corner + 1, corner + across], [corner + 1, corner + across + 1, corner + across]]:
				if _belongs(triangle, points, covered, limit):
					if _faces_away(triangle, points, normals):
						triangle.reverse()
					indices.append_array(PackedInt32Array(triangle))
	var arrays := []
	arrays.resize(Mesh.ARRAY_MAX)
	arrays[Mesh.ARRAY_VERTEX] = points
	arrays[Mesh.ARRAY_NORMAL] = normals
	arrays[Mesh.ARRAY_TEX_UV2] = places
	arrays[Mesh.ARRAY_INDEX] = indices
	var mesh := ArrayMesh.new()
	if indices:
		mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays)
	return mesh


## Bounds of nine tenths of the covered texels along each axis, in Godot's frame, without what a view sees far away.
static func bounds(asset: SrbfAsset) -> AABB:
	var sides: Array[PackedFloat32Array] = [PackedFloat32Array(), PackedFloat32Array(), PackedFloat32Array()]
	for row in asset.height:
		for column in asset.width:
			if not asset.coverage or asset.coverage.get_pixel(column, row).r >= 0.5:
				var place := asset.point(Vector2i(column, row))
				for axis in 3:
					sides[axis].append(place[axis])
	var low := Vector3.ZERO
	var high := Vector3.ZERO
	for axis in 3:
		sides[axis].sort()
		var count := sides[axis].size()
		low[axis] = sides[axis][count / 20] if count else 0.0
		high[axis] = sides[axis][count - 1 - count / 20] if count else 0.0
	return AABB(low, high - low)


## Every `step`-th texel of a side, and the last one.
static func _steps(size: int, step: int) -> PackedInt32Array:
	var chosen := PackedInt32Array(range(0, size, step))
	if chosen[-1] != size - 1:
		chosen.append(size - 1)
	return chosen


static func _belongs(triangle: Array, points: PackedVector3Array, covered: PackedByteArray, limit: float) -> bool:
	for n in 3:
		if not covered[triangle[n]] or points[triangle[n]].distance_to(points[triangle[(n + 1) % 3]]) > limit:
			return false
	return true


## Godot's front faces are clockwise.
static func _faces_away(triangle: Array, points: PackedVector3Array, normals: PackedVector3Array) -> bool:
	var across := (points[triangle[1]] - points[triangle[0]]).cross(points[triangle[2]] - points[triangle[0]])
	return across.dot(normals[triangle[0]]) > 0.0
