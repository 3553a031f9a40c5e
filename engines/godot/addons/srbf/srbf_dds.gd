# SPDX-License-Identifier: MIT
@tool
class_name SrbfDds
extends RefCounted
## Reads the layers of a texture array from a DDS file, still compressed, with their mip levels.

const HEADER := 148  # bytes, with the DX10 extension
const DX10 := 0x30315844
const FORMATS := {98: Image.FORMAT_BPTC_RGBA, 71: Image.FORMAT_DXT1, 28: Image.FORMAT_RGBA8, 10: Image.FORMAT_RGBAH}  # by DXGI's number
const SMALLEST := {98: [4, 16], 71: [4, 8], 28: [1, 4], 10: [1, 8]}  # texels per side and bytes of a block


## Empty, with an error in the log, where the file is not such an array.
static func read(path: String) -> Array[Image]:
	var bytes := FileAccess.get_file_as_bytes(path)
	if bytes.size() < HEADER or bytes.decode_u32(84) != DX10 or not FORMATS.has(bytes.decode_u32(128)):
		push_error("expected a DDS texture array of BC7, BC1, bytes or half floats at %s, found none" % path)
		return []
	var height := bytes.decode_u32(12)
	var width := bytes.decode_u32(16)
	var levels := bytes.decode_u32(28)
	var number := bytes.decode_u32(128)
	var size := 0
	for level in levels:
		size += _level_bytes(number, maxi(width >> level, 1), maxi(height >> level, 1))
	var layers: Array[Image] = []
	for layer in bytes.decode_u32(140):
		var data := bytes.slice(HEADER + layer * size, HEADER + (layer + 1) * size)
		var full := size
		if levels > 1:
			full = Image.create_empty(width, height, true, FORMATS[number]).get_data().size()
		if data.size() < full:  # Godot requires all levels down to one texel; those that the file lacks are never read
			data.resize(full)
		layers.append(Image.create_from_data(width, height, levels > 1, FORMATS[number], data))
	return layers


static func _level_bytes(number: int, width: int, height: int) -> int:
	var side: int = SMALLEST[number][0]
	return ceili(float(width) / side) * ceili(float(height) / side) * int(SMALLEST[number][1])
