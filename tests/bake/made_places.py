"""What a scene may have for a cloud: random places and patches."""

from __future__ import annotations

import numpy as np

from srbf.bake.light_sets import FoundPlaces
from srbf.visibility.patches import Patches
from srbf.visibility.surface_cells import Cells, Fragments

BOX = (0.0, 0.0, 0.0, 2.0, 2.0, 2.0)


def places_of(lights: int = 5, tested: int = 6) -> FoundPlaces:
    rng = np.random.default_rng(2)
    image = rng.uniform(0.1, 1, (2, 12, 4)).astype(np.float32)
    image[1, :, 3] = np.arange(12) % 4
    corners = rng.uniform(0, 2, (30, 3, 3)).astype(np.float32)
    patches = Patches(Cells.of_image(image), Fragments(corners, np.full((30, 3), 0.5, np.float32)), np.arange(30) % 4)
    return FoundPlaces(rng.uniform(0, 2, (lights, 3)), rng.uniform(0, 2, (tested, 3)), rng.uniform(0, 2, (9, 3)), BOX, patches)
