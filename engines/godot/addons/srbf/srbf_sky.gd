# SPDX-License-Identifier: MIT
@tool
class_name SrbfSky
extends RefCounted
## An environment map as distant lights, one per texel, and as what the cells of a transfer asset's environment have in them.

const ROWS := 8  # in which a map is read at least, per side of a cell; twice as many columns

## A panorama in linear radiance, at most so wide; bytes are sRGB.
static func panorama(sky: Texture2D, width: int) -> Image:
	var image := sky.get_image().duplicate() as Image
	if image.is_compressed():
		image.decompress()
	var encoded := image.get_format() <= Image.FORMAT_RGBA8
	image.convert(Image.FORMAT_RGBF)
	if encoded:
		for row in image.get_height():
			for column in image.get_width():
				image.set_pixel(column, row, image.get_pixel(column, row).srgb_to_linear())
	while image.get_width() > width and image.get_height() > 1:
		image.shrink_x2()
	return image


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


## The mean radiance of a panorama in linear radiance in every cell of the octahedral map of directions, `side` squared, row by row.
static func cell_radiance(sky: Image, rotation: Basis, side: int) -> PackedVector3Array:
	var height := sky.get_height() * ceili(float(ROWS * side) / sky.get_height())
	var width := sky.get_width() * ceili(2.0 * ROWS * side / sky.get_width())
	var flux := PackedVector3Array()
	flux.resize(side * side)
	var whole := PackedFloat64Array()
	whole.resize(side * side)
	for row in height:
		var top := PI / 2.0 - row * PI / height
		var solid_angle := sin(top) - sin(top - PI / height)
		var level := sin(top - PI / (2.0 * height))
		var out := sqrt(1.0 - level * level)
		for column in width:
			var azimuth := (column + 0.5) / width * TAU
			var place := SrbfAsset.octahedral(rotation * Vector3(out * sin(azimuth), level, -out * cos(azimuth)))
			var cell := Vector2i((place + Vector2.ONE) * (0.5 * side)).clampi(0, side - 1)
			var color := sky.get_pixel(column * sky.get_width() / width, row * sky.get_height() / height)
			flux[cell.y * side + cell.x] += Vector3(color.r, color.g, color.b) * solid_angle
			whole[cell.y * side + cell.x] += solid_angle
	for cell in flux.size():
		flux[cell] /= maxf(whole[cell], 1e-30)
	return flux
