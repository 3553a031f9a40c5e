"""The bake as its host sees it: plan the lights, run Blender's worker, write the capture."""
