# SPDX-License-Identifier: MIT
@tool
extends EditorImportPlugin
## Imports NAME.srbf, whose one line is the path of an asset.json, as a SrbfAsset. An exported game cannot read EXR, so everything is read here.


func _get_importer_name() -> String:
	return "srbf.asset"


func _get_visible_name() -> String:
	return "Relighting asset"


func _get_recognized_extensions() -> PackedStringArray:
	return ["srbf"]


func _get_save_extension() -> String:
	return "res"


func _get_resource_type() -> String:
	return "Resource"


func _get_preset_count() -> int:
	return 1


func _get_preset_name(_preset: int) -> String:
	return "Default"


func _get_import_options(_path: String, _preset: int) -> Array[Dictionary]:
	return []


func _get_option_visibility(_path: String, _option: StringName, _options: Dictionary) -> bool:
	return true


func _get_priority() -> float:
	return 1.0


func _get_import_order() -> int:
	return 0


func _import(source: String, save_path: String, _options: Dictionary, _variants: Array[String], _files: Array[String]) -> Error:
	var named := FileAccess.get_file_as_string(source).strip_edges()
	var asset: Resource = preload("srbf_asset.gd").read(source.get_base_dir().path_join(named))
	if asset == null:
		return ERR_FILE_CORRUPT
	return ResourceSaver.save(asset, "%s.%s" % [save_path, _get_save_extension()], ResourceSaver.FLAG_COMPRESS)
