# SPDX-License-Identifier: MIT
class_name SrbfGodotLight
extends RefCounted
## What Godot's lights mean, by its documentation and shaders.

const NO_CONE := Vector2(3.0, 4.0)  # above every 1 - cos: a point light


## A light's irradiance on a surface that faces it, at 1 m from an omni or spot light: linear, Godot's unit times π.
static func irradiance(light: Light3D) -> Vector3:
	var color := light.light_color.srgb_to_linear()
	var sign := -1.0 if light.light_negative else 1.0
	return Vector3(color.r, color.g, color.b) * (sign * light.light_energy * PI)


## 1 - cos of a spot's inner and outer half-angles. Godot's 1 - t^(1/a), t = (1 - cos) / (1 - cos outer), and the smooth step are ½ at one angle.
static func cone(light: Light3D) -> Vector2:
	if not light is SpotLight3D:
		return NO_CONE
	var half_sine := sin(deg_to_rad(light.spot_angle) / 2.0)
	var outer := 2.0 * half_sine * half_sine
	var inner := outer * maxf(0.0, 2.0 * pow(0.5, maxf(light.spot_angle_attenuation, 1e-3)) - 1.0)
	return Vector2(inner, outer)


static func decay(light: Light3D) -> float:
	return light.spot_attenuation if light is SpotLight3D else (light as OmniLight3D).omni_attenuation


## How much of a point light's flux a spot sends out: 1 of an omni light. The smooth step between its half-angles lets half through.
static func flux_share(light: Light3D) -> float:
	var edges := cone(light)
	return (edges.x + edges.y) / 4.0 if light is SpotLight3D else 1.0
