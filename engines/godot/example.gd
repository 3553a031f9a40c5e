# SPDX-License-Identifier: MIT
extends Node3D
## A point light to drag over the asset: over model.glb, a mesh through its texels, or its flat picture; named lights to switch.

const HELP := "drag: move the light    wheel: raise it    Tab: %s    S: sun    arrows: turn the sun    + -: exposure of the picture"
const NAMED_HELP := "1 to 9: switch %s    Tab: %s    + -: exposure of the picture"
const MODEL := "res://model.glb"  # second UV layer: the asset's
const TURN := 0.03  # radians per key press

var _dragged := false
var _middle := Vector3.ZERO
var _size := 1.0
var _model: Node3D

@onready var _asset: SrbfAsset = $Relight.asset
@onready var _picture: ColorRect = $Canvas/Picture


func _ready() -> void:
	if _asset.position:
		if ResourceLoader.exists(MODEL) and not _asset.probes:
			_show_model()
		elif not _asset.probes:
			$Surface.mesh = SrbfTexelMesh.of(_asset)
		var box := SrbfTexelMesh.bounds(_asset)
		_middle = box.get_center()
		_size = maxf(box.get_longest_axis_size(), 1e-3)
	else:
		$PointLight.visible = false
	$Camera.look_at_from_position(_middle + Vector3(0.0, 0.65, 0.8) * _size, _middle)
	$Camera.far = maxf(1000.0, 10.0 * _size)
	$PointLight.position = _middle + Vector3(-0.2, 0.3, 0.1) * _size
	$PointLight.light_energy *= 0.4 * _size  # its light falls off with distance
	if _asset.is_view:
		$Sun.light_energy = 1.0
		$Relight.exposure = 0.5
	if _asset.position_table:
		_light_a_room()
	if _asset.probes:
		_show_sphere()
	if _asset.light_table:
		$PointLight.visible = false
	if _asset.is_weighted():
		$Sun.visible = false
	$PointLight/Bulb.scale = Vector3.ONE * 0.03 * _size
	get_viewport().size_changed.connect(_fit_picture)
	_fit_picture()
	_show_picture(_asset.is_view or not _asset.position)


func _unhandled_input(event: InputEvent) -> void:
	if event is InputEventMouseButton:
		if event.button_index == MOUSE_BUTTON_LEFT:
			_dragged = event.pressed
		elif event.pressed and event.button_index == MOUSE_BUTTON_WHEEL_UP:
			$PointLight.position.y += 0.02 * _size
		elif event.pressed and event.button_index == MOUSE_BUTTON_WHEEL_DOWN:
			$PointLight.position.y -= 0.02 * _size
	if _dragged and event is InputEventMouse:
		move_point_light(event.position)
	if event is InputEventKey and event.pressed:
		match event.keycode:
			KEY_TAB:
				_show_picture(not _picture.visible)
			KEY_S:
				$Sun.visible = not $Sun.visible and (_asset.surfels != null or not _asset.is_weighted())
			KEY_PLUS, KEY_EQUAL, KEY_KP_ADD:
				$Relight.exposure += 0.5
			KEY_MINUS, KEY_KP_SUBTRACT:
				$Relight.exposure -= 0.5
			KEY_LEFT:
				$Sun.rotate_y(-TURN)
			KEY_RIGHT:
				$Sun.rotate_y(TURN)
			KEY_UP:
				$Sun.rotate_object_local(Vector3.RIGHT, -TURN)
			KEY_DOWN:
				$Sun.rotate_object_local(Vector3.RIGHT, TURN)
		if event.keycode >= KEY_1 and event.keycode <= KEY_9:
			switch_light(event.keycode - KEY_1)


## Move the light under the mouse at constant height: over the surface's plane, or over the picture's texel.
func move_point_light(mouse: Vector2) -> void:
	if not _asset.position:
		return
	if _picture.visible:
		var place := (mouse - _picture.position) / _picture.size
		var texel := Vector2i(place * Vector2(_asset.width, _asset.height)).clamp(Vector2i.ZERO, Vector2i(_asset.width - 1, _asset.height - 1))
		var point := _asset.point(texel)
		$PointLight.position = Vector3(point.x, $PointLight.position.y, point.z)
		return
	var plane := Plane(Vector3.UP, $PointLight.position)
	var hit = plane.intersects_ray($Camera.project_ray_origin(mouse), $Camera.project_ray_normal(mouse))
	if hit != null:
		$PointLight.position = hit


## A named light on, as the scene has it set, or off.
func switch_light(number: int) -> void:
	var names: PackedStringArray = $Relight.light_names()
	if number < names.size():
		$Relight.set_light(names[number], 0.0 if $Relight.intensities.get(names[number], 1.0) > 0.0 else 1.0)


## Inside a scene: inverse-square, in the middle, and Godot's shadows, since the asset has bounces alone.
func _light_a_room() -> void:
	$PointLight.omni_attenuation = 2.0
	$PointLight.omni_range = 4.0 * _size
	$PointLight.light_energy = 0.04 * _size * _size
	$PointLight.shadow_enabled = true
	$PointLight.position = _middle
	$Sun.shadow_enabled = true
	$Surface.cast_shadow = GeometryInstance3D.SHADOW_CASTING_SETTING_DOUBLE_SIDED


## What moves between probes; give the room's own meshes and their lightmap in a scene of yours.
func _show_sphere() -> void:
	var probes := SrbfProbes.new()
	probes.asset = _asset
	var sphere := MeshInstance3D.new()
	sphere.mesh = $PointLight/Bulb.mesh
	sphere.transform = Transform3D(Basis.from_scale(Vector3.ONE * 0.2 * _size), _middle)
	probes.add_child(sphere)
	add_child(probes)
	$PointLight.position = _middle + Vector3(0.1, 0.2, 0.2) * _size


func _show_model() -> void:
	_model = load(MODEL).instantiate()
	add_child(_model)
	for mesh: MeshInstance3D in _model.find_children("*", "MeshInstance3D", true, false):
		mesh.cast_shadow = GeometryInstance3D.SHADOW_CASTING_SETTING_DOUBLE_SIDED  # walls are thin
	var surfaces: Array[Node] = [_picture]
	surfaces.append_array(_model.find_children("*", "MeshInstance3D", true, false))
	$Relight.surfaces = surfaces
	$Relight.apply()


func _show_picture(flat: bool) -> void:
	_picture.visible = flat
	$Surface.visible = not flat
	if _model:
		_model.visible = not flat
	var other := "mesh" if flat else "picture"
	$Canvas/Help.text = NAMED_HELP % [", ".join($Relight.light_names().slice(0, 9)), other] if _asset.light_table else HELP % other


func _fit_picture() -> void:
	var room := get_viewport().get_visible_rect().size
	var zoom := minf(room.x / _asset.width, room.y / _asset.height)
	_picture.size = Vector2(_asset.width, _asset.height) * zoom
	_picture.position = (room - _picture.size) / 2.0
