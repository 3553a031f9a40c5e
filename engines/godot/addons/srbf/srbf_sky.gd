# SPDX-License-Identifier: MIT
@tool
class_name SrbfSky
extends RefCounted
## An environment map as distant lights, one per texel.


## Projected weights of a panorama as Godot has it, in linear radiance; `rotation` turns Godot's world into the asset's frame.
static func weights(asset: SrbfAsset, sky: Image, rotation: Basis) -> PackedVector4Array:
	var upright := rotation.y.is_equal_approx(Vector3(0.0, 0.0, 1.0))
	var directions := PackedVector3Array()
	var colors := PackedVector3Array()
	for row in sky.get_height():
		var top := PI / 2.0 - row * PI / sky.get_height()
		var bottom := PI / 2.0 - (row + 1) * PI / sky.get_height()
		if asset.domain == "hemisphere" and upright:  # a row that straddles the horizon ends there
			top = maxf(top, 0.0)
			bottom = maxf(bottom, 0.0)
		var solid_angle := (sin(top) - sin(bottom)) * TAU / sky.get_width()
		var height_angle := (top + bottom) / 2.0
		for column in sky.get_width():
			var azimuth := (column + 0.5) / sky.get_width() * TAU
			var direction := Vector3(cos(height_angle) * sin(azimuth), sin(height_angle), -cos(height_angle) * cos(azimuth))
			direction = rotation * direction
			if solid_angle > 0.0 and (asset.domain == "sphere" or upright or direction.z > 0.0):
				var color := sky.get_pixel(column, row)
				directions.append(direction)
				colors.append(Vector3(color.r, color.g, color.b) * solid_angle)
	return asset.weights(directions, colors)
