# SPDX-License-Identifier: MIT
@tool
class_name SrbfSurfaces
extends Resource
## The tables of an asset fitted with --editable for changes of its objects: albedo and emission. Matrices are half floats, divided by their `scales`.

const MOST_REFLECTED := 0.99  # share of light that a bounce keeps at most
const GRAY := ["gather", "sent"]

@export var names: PackedStringArray
## From radiosity of the surfels to weights of the shapes, and the irradiance of the shapes on the surfels: a row per shape, a column per surfel.
@export var gather: Image
@export var sent: Image
## One bounce of light between shapes, gather · albedo · sent, and the sum of all its powers: a row and a column per shape.
@export var feedback: Image
@export var series: Image
## Weights under objects that emit a mean radiance of 1, without bounces: a row per shape, a column per object.
@export var emission: Image
@export var scales := {}
## How many powers are summed after a change.
@export var terms: int
## Of object o and surfel s at o S + s: the object's part of the surfel's area.
@export var shares: PackedFloat32Array
## Of every surfel.
@export var albedo: PackedVector3Array


## Null where the surfaces of the asset cannot change.
static func read(folder: String, manifest: Dictionary) -> SrbfSurfaces:
	if not manifest.has("surfaces") or not manifest.has("surface_series"):
		return null
	var surfaces := SrbfSurfaces.new()
	surfaces.names = PackedStringArray(manifest.surfaces.objects)
	surfaces.terms = int(manifest.surface_series.terms)
	for name in ["gather", "sent", "feedback", "series", "emission"]:
		var key: String = "surface_" + name
		if not manifest.has(key):
			push_error("expected %s in asset.json, found none; fit the asset again" % key)
			return null
		var image := SrbfAsset.image(folder, manifest[key].file)
		if image == null:
			return null
		image.convert(Image.FORMAT_RH if name in GRAY else Image.FORMAT_RGBAH)
		surfaces.set(name, image)
		surfaces.scales[name] = manifest.surface_series.scale if name == "series" else manifest.surfaces.scales[key]
	surfaces.shares = _numbers(folder, manifest, "surface_objects", Image.FORMAT_RF)
	var colors := _numbers(folder, manifest, "surface_albedo", Image.FORMAT_RGBF)
	for i in range(0, colors.size(), 3):
		surfaces.albedo.append(Vector3(colors[i], colors[i + 1], colors[i + 2]))
	return surfaces


## The albedo of every surfel with changed colors of objects, by name.
func repainted(painted: Dictionary) -> PackedVector3Array:
	var now := albedo.duplicate()
	for o in names.size():
		if painted.has(names[o]):
			var linear: Color = painted[names[o]].srgb_to_linear()
			var color := Vector3(linear.r, linear.g, linear.b).clamp(Vector3.ZERO, Vector3.ONE * MOST_REFLECTED)
			for i in albedo.size():
				now[i] += shares[o * albedo.size() + i] * (color - albedo[i])
	for i in now.size():
		now[i] = now[i].clamp(Vector3.ZERO, Vector3.ONE * MOST_REFLECTED)
	return now


static func _numbers(folder: String, manifest: Dictionary, key: String, format: Image.Format) -> PackedFloat32Array:
	var image := SrbfAsset.image(folder, manifest[key].file)
	image.convert(format)
	var numbers := image.get_data().to_float32_array()
	var scale: float = manifest.surfaces.scales[key]
	for i in numbers.size():
		numbers[i] *= scale
	return numbers
