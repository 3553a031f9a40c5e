# SPDX-License-Identifier: MIT
@tool
class_name SrbfAsset
extends Resource
## An srbf asset as one resource: layers, tables, geometry, and the projected weights of distant lights, or of named ones, or of a cloud's.
##
## Directions and positions are in the asset's own frame, z up; SrbfRelight transforms Godot's y-up world into it.

@export var method: String
@export var quantity: String
## Whether the asset lacks direct light, which the engine adds.
@export var is_indirect: bool
## Whether the texels are the pixels of a fixed camera.
@export var is_view: bool
## A view, or photographs, rather than a texture: its coverage is the picture's alpha.
@export var is_picture: bool
@export_enum("sphere", "hemisphere") var domain := "sphere"
@export var width: int
@export var height: int
## World to the frame that the asset was captured in, both z up.
@export var asset_from_world: Transform3D
@export var layer_images: Array[Image]
## Mip levels of the layers, the full size included.
@export var levels := 1
@export var scale: PackedVector4Array
@export var bias: PackedVector4Array
@export var position: Image
@export var normal: Image
@export var coverage: Image
@export var ambient: Image
## Unit centers of the Gaussians of the maps, or of the light functions.
@export var centers: PackedVector3Array
## Relighting maps: R at cos θ = -1 + 2 j / (n - 1).
@export var r_table: Image
@export var scalars: int
@export var clusters: int
@export var spreads: PackedFloat64Array
## Coefficient maps: red, green, blue of center b in function f at 3 (f B + b).
@export var light_coefficients: PackedFloat32Array
@export var w_table: Image
@export var w_table_size: int
@export var cluster_index: Image
## Of light mixing: the scene's own lights by name.
@export var light_table: SrbfLightTable
## Of lights inside a scene: weights of point lights by their place, and the surfels that any lights are measured by.
@export var position_table: SrbfPositionTable
@export var surfels: SrbfSurfels
## Where the probes are, of an asset of probes: its pictures are of their facets.
@export var probes: SrbfProbeGrid

var _textures := {}
var _table := PackedFloat32Array()  # red, green, blue of w_table


## Read the asset that an asset.json describes; null, with an error in the log, where something is missing.
static func read(manifest_path: String) -> SrbfAsset:
	var manifest = JSON.parse_string(FileAccess.get_file_as_string(manifest_path))
	if not manifest is Dictionary or manifest.get("format") != "srbf-asset" or manifest.get("version") != 1:
		push_error("expected an srbf asset, version 1, at %s, found none" % manifest_path)
		return null
	var folder := manifest_path.get_base_dir()
	var asset := SrbfAsset.new()
	asset.method = manifest.method
	asset.quantity = manifest.quantity
	asset.domain = manifest.get("domain", "sphere")
	asset.is_indirect = manifest.get("transport") == "indirect"
	var receiver := _receiver_kind(manifest)
	asset.is_view = receiver == "view"
	asset.is_picture = receiver in ["view", ""]
	if receiver == "probes":
		asset.probes = SrbfProbeGrid.read(folder, manifest.receiver)
	asset.width = int(manifest.width)
	asset.height = int(manifest.height)
	asset.asset_from_world = _transform(manifest.get("asset_from_world"))
	var layers: Array = manifest.maps if manifest.has("maps") else manifest.planes
	asset.levels = int(layers[0].get("levels", 1))
	var arrays := {}  # layers in one file, by its name
	for layer in layers:
		if layer.has("layer"):
			if not arrays.has(layer.file):
				arrays[layer.file] = SrbfDds.read(folder.path_join(layer.file))
			asset.layer_images.append(arrays[layer.file][layer.layer] if layer.layer < arrays[layer.file].size() else null)
		else:
			asset.layer_images.append(image(folder, layer.file))
		asset.scale.append(_vector4(layer.scale))
		asset.bias.append(_vector4(layer.bias))
	for name in ["position", "normal", "coverage", "ambient"]:
		if manifest.has(name):
			asset.set(name, image(folder, manifest[name]))
	if manifest.has("planes"):
		asset.scalars = int(manifest.scalars)
		asset.clusters = int(manifest.get("clusters", 1))
	if manifest.has("cluster_index"):
		asset.cluster_index = image(folder, manifest.cluster_index.file)
		asset.cluster_index.convert(Image.FORMAT_R8)
	if asset.is_weighted():
		if asset.method in ["light-cloud", "transfer"]:
			asset.position_table = SrbfPositionTable.read(folder, manifest)
			asset.surfels = SrbfSurfels.read(folder, manifest)
		else:
			asset.light_table = SrbfLightTable.read(folder, manifest)
	elif asset.method == "relighting-map":
		asset.centers = _vectors(manifest.basis.centers)
		asset.r_table = image(folder, manifest.r_table.file)
		asset.r_table.convert(Image.FORMAT_RF)
	else:
		asset.centers = _vectors(manifest.light_basis.centers)
		asset.spreads = PackedFloat64Array(manifest.light_basis.spreads)
		var coefficients := image(folder, manifest.light_coefficients.file)
		coefficients.convert(Image.FORMAT_RGBF)
		asset.light_coefficients = coefficients.get_data().to_float32_array()
		asset.w_table = image(folder, manifest.w_table.file)
		asset.w_table_size = int(manifest.w_table.size)
	if asset.layer_images.has(null):
		return null
	return asset


## All stored layers as one texture.
func layers() -> Texture2DArray:
	if not _textures.has("layers"):
		var texture := Texture2DArray.new()
		texture.create_from_images(layer_images)
		_textures.layers = texture
	return _textures.layers


## One of the images as a texture; null where the asset lacks it.
func texture(name: StringName) -> ImageTexture:
	var pixels: Image = get(name)
	if pixels == null:
		return null
	if not _textures.has(name):
		_textures[name] = ImageTexture.create_from_image(pixels)
	return _textures[name]


## Whether every light enters through the weights of a frame: named lights, and lights of a cloud. A texel's cost is that of one sun.
func is_weighted() -> bool:
	return method in ["light-mix", "named-maps", "light-cloud", "transfer"]


## The first lines of a shader for this asset.
func defines() -> String:
	var kind := ("#define SRBF_IRRADIANCE\n" if quantity == "irradiance" else "") + ("#define SRBF_INDIRECT\n" if is_indirect and quantity == "irradiance" else "")
	if is_weighted():
		kind += "#define SRBF_WEIGHTED\n"
	if scalars == 0:
		return kind + "#define SRBF_RELIGHTING_MAP\n#define SRBF_K %d\n#define SRBF_LAYERS %d\n" % [scale.size(), scale.size()]
	var name := "SRBF_CLUSTERED_EIGEN_MAP" if cluster_index else "SRBF_EIGEN_MAP"
	return kind + "#define %s\n#define SRBF_COMPONENTS %d\n#define SRBF_LAYERS %d\n" % [name, scalars, scale.size()]


## One weight per map, or per light function of every cluster, for all distant lights together: the sum of color w(direction), w = 1.
## `by_table`: coefficient maps by the table of point lights, with the error w_table.error of asset.json, in a fraction of the time.
func weights(directions: PackedVector3Array, colors: PackedVector3Array, by_table := false) -> PackedVector4Array:
	if method == "relighting-map":
		return _map_weights(directions, colors)
	return _table_weights(directions, colors) if by_table else _function_weights(directions, colors)


func _map_weights(directions: PackedVector3Array, colors: PackedVector3Array) -> PackedVector4Array:
	var table := r_table.get_data().to_float32_array()
	var middle := 0.5 * (table.size() - 1)
	var sums := PackedVector4Array()
	for center in centers:
		var sum := Vector3.ZERO
		for n in directions.size():
			var place := (clampf(directions[n].dot(center), -1.0, 1.0) + 1.0) * middle
			var entry := mini(int(place), table.size() - 2)
			sum += colors[n] * lerpf(table[entry], table[entry + 1], place - entry)
		sums.append(Vector4(sum.x, sum.y, sum.z, 1.0))
	return sums


func _function_weights(directions: PackedVector3Array, colors: PackedVector3Array) -> PackedVector4Array:
	var gaussians := {}  # by spread, of which there are few
	for spread in spreads:
		if not gaussians.has(spread):
			gaussians[spread] = _gaussians(spread, directions, colors)
	var sums := PackedVector4Array()
	var at := 0
	for spread in spreads:
		var gaussian: PackedFloat64Array = gaussians[spread]
		var red := 0.0
		var green := 0.0
		var blue := 0.0
		for b in range(0, gaussian.size(), 3):
			red += light_coefficients[at] * gaussian[b]
			green += light_coefficients[at + 1] * gaussian[b + 1]
			blue += light_coefficients[at + 2] * gaussian[b + 2]
			at += 3
		sums.append(Vector4(red, green, blue, 1.0))
	return sums


func _table_weights(directions: PackedVector3Array, colors: PackedVector3Array) -> PackedVector4Array:
	if _table.is_empty():
		var table: Image = w_table.duplicate()
		table.convert(Image.FORMAT_RGBF)
		_table = table.get_data().to_float32_array()
	var row := w_table.get_width()
	var columns := row / w_table_size
	var sums := PackedVector3Array()
	sums.resize(spreads.size())
	for n in directions.size():
		var place := (octahedral(directions[n]) + Vector2.ONE) * (0.5 * (w_table_size - 1))
		var node := Vector2i(place).clampi(0, w_table_size - 2)
		var part := place - Vector2(node)
		for f in sums.size():
			var at := ((f / columns) * w_table_size + node.y) * row + (f % columns) * w_table_size + node.x
			var top := _entry(at).lerp(_entry(at + 1), part.x)
			var bottom := _entry(at + row).lerp(_entry(at + row + 1), part.x)
			sums[f] += colors[n] * top.lerp(bottom, part.y)
	var padded := PackedVector4Array()
	for sum in sums:
		padded.append(Vector4(sum.x, sum.y, sum.z, 1.0))
	return padded


## Position of a texel in Godot's frame, y up.
func point(texel: Vector2i) -> Vector3:
	return to_godot(position.get_pixel(texel.x, texel.y))


func _entry(texel: int) -> Vector3:
	return Vector3(_table[3 * texel], _table[3 * texel + 1], _table[3 * texel + 2])


## A direction's place on the octahedral square, -1 to 1 [Cigolle2014].
static func octahedral(direction: Vector3) -> Vector2:
	var d := direction / (absf(direction.x) + absf(direction.y) + absf(direction.z))
	if d.z >= 0.0:
		return Vector2(d.x, d.y)
	return Vector2((1.0 - absf(d.y)) * (-1.0 if d.x < 0.0 else 1.0), (1.0 - absf(d.x)) * (-1.0 if d.y < 0.0 else 1.0))


func _gaussians(spread: float, directions: PackedVector3Array, colors: PackedVector3Array) -> PackedFloat64Array:
	var sums := PackedFloat64Array()
	for center in centers:
		var sum := Vector3.ZERO
		for n in directions.size():
			var angle := acos(clampf(directions[n].dot(center), -1.0, 1.0)) / spread
			sum += colors[n] * exp(-0.5 * angle * angle)
		sums.append_array([sum.x, sum.y, sum.z])
	return sums


## What is lit: its kind, or "" where the asset does not say. Assets of older versions say so under `source`.
static func _receiver_kind(manifest: Dictionary) -> String:
	for place in [manifest, manifest.get("source", {})]:
		if place.has("receiver"):
			return place.receiver.get("kind", "")
		if place.get("receivers", []):
			return place.receivers[0].get("kind", "")
	return ""


## An image of an asset; null, with an error in the log, where it is missing.
static func image(folder: String, file: String) -> Image:
	var path := folder.path_join(file)
	var found := Image.load_from_file(ProjectSettings.globalize_path(path))
	if found == null:
		push_error("expected an image at %s, found none" % path)
	return found


static func _transform(rows: Variant) -> Transform3D:
	if rows == null:
		return Transform3D.IDENTITY
	var columns: Array[Vector3] = []
	for column in 4:
		columns.append(Vector3(rows[0][column], rows[1][column], rows[2][column]))
	return Transform3D(columns[0], columns[1], columns[2], columns[3])


static func _vectors(listed: Array) -> PackedVector3Array:
	var vectors := PackedVector3Array()
	for numbers in listed:
		vectors.append(Vector3(numbers[0], numbers[1], numbers[2]).normalized())
	return vectors


static func _vector4(numbers: Array) -> Vector4:
	return Vector4(numbers[0], numbers[1], numbers[2], numbers[3] if numbers.size() > 3 else 0.0)


## A vector of the asset's frame in Godot's, y up.
static func to_godot(color: Color) -> Vector3:
	return Vector3(color.r, color.b, -color.g)
