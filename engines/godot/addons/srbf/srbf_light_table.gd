# SPDX-License-Identifier: MIT
@tool
class_name SrbfLightTable
extends Resource
## The scene's own lights by name, and the weights of any mix of them: sum over lights of color times a column of values.

@export var names: PackedStringArray
## Red, green, blue of light function f at light n: 3 (f N + n). Empty where each light has a map of its own.
@export var values: PackedFloat32Array


static func read(folder: String, manifest: Dictionary) -> SrbfLightTable:
	var table := SrbfLightTable.new()
	for light in manifest.lights:
		table.names.append(light.name)
	if manifest.has("light_values"):
		var image := SrbfAsset.image(folder, manifest.light_values.file)
		image.convert(Image.FORMAT_RGBF)
		table.values = image.get_data().to_float32_array()
		var scale: float = manifest.light_values.scale
		for i in table.values.size():
			table.values[i] *= scale
	return table


## One weight per light function, or per light: `colors` are linear, intensity times color, 1 as the scene has a light set.
func weights(colors: PackedVector3Array) -> PackedVector4Array:
	var count := names.size()
	var sums := PackedVector4Array()
	if values.is_empty():
		for color in colors:
			sums.append(Vector4(color.x, color.y, color.z, 1.0))
		return sums
	for f in values.size() / (3 * count):
		var sum := Vector3.ZERO
		for n in count:
			var at := 3 * (f * count + n)
			sum += colors[n] * Vector3(values[at], values[at + 1], values[at + 2])
		sums.append(Vector4(sum.x, sum.y, sum.z, 1.0))
	return sums
