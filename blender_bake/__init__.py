# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake worker: runs inside Blender (or the bpy module), in a process of its own. It imports bpy and numpy, nothing of srbf."""
