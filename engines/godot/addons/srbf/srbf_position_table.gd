# SPDX-License-Identifier: MIT
@tool
class_name SrbfPositionTable
extends Resource
## Weights of point lights by where they stand, without rays: RGB light functions at the nodes of a grid, mixed by what a light sees of them.
##
## A light takes eight nodes; then one product of a vector and a matrix gives the weights of all lights together.

const SEEN := 1e-4  # sum of its cell's weights below which a light sees no node

@export var origin: Vector3
@export var spacing := 1.0
## Nodes along x, y, z.
@export var nodes: Vector3i
## Places per cell and axis at which it is known which corners are seen.
@export var fine: int
@export var functions: int
## `rank` numbers of every node, x fastest.
@export var rank: int
@export var node_values: PackedFloat32Array
## Red, green, blue of function f on axis r: 3 (r F + f).
@export var basis: PackedFloat32Array
## How much of each corner of its cell a fine place sees: rows by z and y, columns by x and corner.
@export var seen: PackedByteArray

var _blocks: Array[Projection] = []  # of four functions by four axes: red, green, blue


static func read(folder: String, manifest: Dictionary) -> SrbfPositionTable:
	var table := SrbfPositionTable.new()
	var told: Dictionary = manifest.position_table
	table.origin = Vector3(told.origin[0], told.origin[1], told.origin[2])
	table.spacing = told.spacing
	table.nodes = Vector3i(told.nodes[0], told.nodes[1], told.nodes[2])
	table.fine = int(told.fine)
	table.rank = int(told.rank)
	var image := SrbfAsset.image(folder, manifest.position_nodes.file)
	image.convert(Image.FORMAT_RF)
	table.node_values = image.get_data().to_float32_array()
	image = SrbfAsset.image(folder, manifest.position_basis.file)
	table.functions = image.get_width()
	image.convert(Image.FORMAT_RGBF)
	table.basis = image.get_data().to_float32_array()
	image = SrbfAsset.image(folder, manifest.position_visibility.file)
	image.convert(Image.FORMAT_R8)
	table.seen = image.get_data()
	return table


## One weight per light function of all lights together; `places` in the asset's frame (m), `colors` the irradiance at 1 m, linear.
func weights(places: PackedVector3Array, colors: PackedVector3Array) -> PackedVector4Array:
	var mixed := PackedVector3Array()
	mixed.resize(ceili(rank / 4.0) * 4)
	for n in places.size():
		var found := corners(places[n])
		for c in 8:
			var color: Vector3 = colors[n] * found[1][c]
			var first: int = rank * found[0][c]
			if color != Vector3.ZERO:
				for r in rank:
					mixed[r] += color * node_values[first + r]
	return _product(mixed)


## Whether a light at a place sees any node: elsewhere, as inside a wall, its weights are those of the nodes around.
func sees(place: Vector3) -> bool:
	return corners(place)[2]


## [the eight nodes about a place, their weights, whether the place sees any of them].
func corners(place: Vector3) -> Array:
	var at := ((place - origin) / spacing).clamp(Vector3.ZERO, Vector3(nodes - Vector3i.ONE))
	var cell := Vector3i(at).min(nodes - Vector3i(2, 2, 2))
	var part := at - Vector3(cell)
	var first := Vector3(cell * fine)
	var step := (at * fine - Vector3(0.5, 0.5, 0.5)).clamp(first, first + Vector3.ONE * (fine - 1))  # of the light's own cell alone
	var low := Vector3i(step).min(cell * fine + Vector3i.ONE * (fine - 2))
	var between := step - Vector3(low)
	var row := 8 * fine * (nodes.x - 1)
	var amounts := PackedFloat32Array([0, 0, 0, 0, 0, 0, 0, 0])
	for corner in 8:
		var offset := _offset(corner)
		var amount := _share(offset, between)
		var texel := low + offset
		var start := (texel.z * fine * (nodes.y - 1) + texel.y) * row + 8 * texel.x
		for c in 8:
			amounts[c] += amount * seen[start + c] / 255.0
	var found := PackedInt32Array()
	var shares := PackedFloat32Array()
	var total := 0.0
	for corner in 8:
		var node := cell + _offset(corner)
		found.append((node.z * nodes.y + node.y) * nodes.x + node.x)
		shares.append(_share(_offset(corner), part))
		total += shares[corner] * amounts[corner]
	if total >= SEEN:
		for corner in 8:
			shares[corner] *= amounts[corner] / total
	return [found, shares, total >= SEEN]


## Sum over axes of `mixed` times the basis, sixteen products at a time.
func _product(mixed: PackedVector3Array) -> PackedVector4Array:
	if _blocks.is_empty():
		_make_blocks()
	var count := mixed.size() / 4
	var red: Array[Vector4] = []
	var green: Array[Vector4] = []
	var blue: Array[Vector4] = []
	for b in count:
		var i := 4 * b
		red.append(Vector4(mixed[i].x, mixed[i + 1].x, mixed[i + 2].x, mixed[i + 3].x))
		green.append(Vector4(mixed[i].y, mixed[i + 1].y, mixed[i + 2].y, mixed[i + 3].y))
		blue.append(Vector4(mixed[i].z, mixed[i + 1].z, mixed[i + 2].z, mixed[i + 3].z))
	var sums := PackedVector4Array()
	var at := 0
	for first in range(0, functions, 4):
		var r := Vector4.ZERO
		var g := Vector4.ZERO
		var b := Vector4.ZERO
		for block in count:
			r += _blocks[at] * red[block]
			g += _blocks[at + 1] * green[block]
			b += _blocks[at + 2] * blue[block]
			at += 3
		for i in mini(4, functions - first):
			sums.append(Vector4(r[i], g[i], b[i], 1.0))
	return sums


func _make_blocks() -> void:
	for first in range(0, functions, 4):
		for axis in range(0, rank, 4):
			for channel in 3:
				var columns: Array[Vector4] = []
				for r in range(axis, axis + 4):
					var column := Vector4.ZERO
					if r < rank:
						for i in mini(4, functions - first):
							column[i] = basis[3 * (r * functions + first + i) + channel]
					columns.append(column)
				_blocks.append(Projection(columns[0], columns[1], columns[2], columns[3]))


static func _offset(corner: int) -> Vector3i:
	return Vector3i(corner & 1, corner >> 1 & 1, corner >> 2)


static func _share(offset: Vector3i, part: Vector3) -> float:
	return (part.x if offset.x else 1.0 - part.x) * (part.y if offset.y else 1.0 - part.y) * (part.z if offset.z else 1.0 - part.z)
