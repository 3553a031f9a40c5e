# SPDX-License-Identifier: MIT
@tool
class_name SrbfSurfels
extends Resource
## Surfels, small parts of the scene's surfaces on which irradiance is measured, and the tables from that irradiance to the weights of an asset.

const TABLE_WIDTH := 4096  # texels

## Of every cell, in the asset's frame, ordered by patch: place (m), unit normal, area (square meters).
@export var places: PackedVector3Array
@export var normals: PackedVector3Array
@export var areas: PackedFloat32Array
## Of every patch: its first cell, and of the last one's end.
@export var starts: PackedInt32Array
## From the mean irradiance on the patches to the weights, one after the other: half floats, row after row, in rows of TABLE_WIDTH texels.
@export var tables: Array[Image]
@export var rows: PackedInt32Array
@export var columns: PackedInt32Array
@export var scales: PackedFloat32Array
## From the radiance in cells of an octahedral map of directions, `environment_side` squared, to weights that are added to the sums of the first table: a column
## per number in `environment_cells`. Null if no surfel sees the environment.
@export var environment: Image
@export var environment_cells: PackedInt32Array
@export var environment_side: int
@export var environment_scale: float
## Of an asset whose surfaces can change.
@export var surfaces: SrbfSurfaces


## Null where the lights of the asset are not measured by irradiance on patches.
static func read(folder: String, manifest: Dictionary) -> SrbfSurfels:
	if not manifest.has("cells") or manifest.get("interpolation", {}).get("kind") == "kernel":
		return null
	var surfels := SrbfSurfels.new()
	var cells := SrbfAsset.image(folder, manifest.cells.file)
	if cells == null:
		return null
	cells.convert(Image.FORMAT_RGBAF)
	var told: Dictionary = manifest.get("surfel_transfer", {})
	var patches: int = int(told.surfels) if told else int(manifest.light_values.lights)
	surfels._sort(cells.get_data().to_float32_array(), cells.get_width(), patches)
	if told:
		surfels._add(folder, told, int(told.rank), patches)
		surfels.surfaces = SrbfSurfaces.read(folder, manifest)
		surfels._read_environment(folder, manifest.get("environment_transfer", {}))
	var functions: int = int(manifest.get("clusters", 1)) * (int(manifest.scalars) + 1)
	surfels._add(folder, manifest.light_values, functions, int(manifest.light_values.lights))
	return null if surfels.tables.has(null) else surfels


func count() -> int:
	return areas.size()


func patch_count() -> int:
	return starts.size() - 1


func _read_environment(folder: String, told: Dictionary) -> void:
	if told.get("cells", []).is_empty():
		return
	environment = SrbfAsset.image(folder, told.file)
	environment.convert(Image.FORMAT_RGBAH)
	environment_cells = PackedInt32Array(told.cells)
	environment_side = int(told.side)
	environment_scale = told.scale


func _sort(cells: PackedFloat32Array, number: int, patches: int) -> void:
	starts.resize(patches + 1)
	starts.fill(0)
	for i in number:
		starts[roundi(cells[4 * (number + i) + 3]) + 1] += 1
	for patch in patches:
		starts[patch + 1] += starts[patch]
	places.resize(number)
	normals.resize(number)
	areas.resize(number)
	var next := starts.duplicate()
	for i in number:
		var own := 4 * (number + i)
		var at := next[roundi(cells[own + 3])]
		next[roundi(cells[own + 3])] += 1
		places[at] = Vector3(cells[4 * i], cells[4 * i + 1], cells[4 * i + 2])
		areas[at] = cells[4 * i + 3]
		normals[at] = Vector3(cells[own], cells[own + 1], cells[own + 2])


func _add(folder: String, entry: Dictionary, row_count: int, column_count: int) -> void:
	var image := SrbfAsset.image(folder, entry.file)
	tables.append(_folded(image, int(entry.get("channels", 3)) == 1) if image else null)
	rows.append(row_count)
	columns.append(column_count)
	scales.append(entry.scale)


## The texels in the same order, in rows that every GPU takes.
static func _folded(image: Image, gray: bool) -> Image:
	image.convert(Image.FORMAT_RH if gray else Image.FORMAT_RGBAH)
	var height := ceili(float(image.get_width() * image.get_height()) / TABLE_WIDTH)
	var data := image.get_data()
	data.resize(TABLE_WIDTH * height * (2 if gray else 8))
	return Image.create_from_data(TABLE_WIDTH, height, false, image.get_format(), data)
