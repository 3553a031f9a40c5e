"""Light from the brightest surfels of a pool on receivers, by passes of the GPU: a cube of shadow maps about each group of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float
from srbf.gl.deep_framebuffer import folded
from srbf.gl.programs import Programs
from srbf.lights import PointLight, triple
from srbf.visibility.gl_resources import Resources
from srbf.visibility.near_sources import MOST, NearSources, lift_above
from srbf.visibility.surfel_light import SurfelLight

if TYPE_CHECKING:
    import moderngl


class NearPasses:
    """What `NearSources` lay on several sets of receivers, each into a texture with one texel for each receiver.

    Parameters
    ----------
    programs
        Of the context, which is current whenever `draw` is called.
    surfels
        Whose shadow cube is drawn.
    receivers
        Places (m) and unit normals of each set.
    """

    def __init__(
        self, programs: Programs, surfels: SurfelLight, receivers: list[tuple[Float[ndarray, "_ 3"], Float[ndarray, "_ 3"]]]
    ) -> None:
        self._programs, self._surfels = programs, surfels
        resources = Resources(programs.context)
        programs.resources.callback(resources.close)
        self._lift = lift_above(np.concatenate([places for places, _ in receivers]))
        self._receivers = []
        for places, normals in receivers:
            pixels = [folded(np.column_stack([own, 0 * own[:, :1]]).astype(np.float32)) for own in (places - surfels.center, normals)]
            self._receivers.append([resources.texture(image) for image in pixels])
        self._sources = resources.texture(np.zeros((3, MOST, 4), np.float32))

    def draw(self, near: NearSources, targets: list[moderngl.Framebuffer]) -> None:
        """Add the light of `near` into a target for each set; blending is left on and additive."""
        gl: Any = self._programs.context
        order = np.argsort(near.groups, kind="stable")
        own = near.cells.at(order)
        sources = np.zeros((3, MOST, 4), np.float32)
        sources[0, : near.count] = np.column_stack([own.places - self._surfels.center, own.areas])
        sources[1, : near.count, :3], sources[2, : near.count, :3] = own.normals, near.radiosity[order]
        self._sources.write(sources)
        sizes = np.bincount(near.groups, minlength=len(near.places))
        for first, count, place in zip(np.cumsum(sizes) - sizes, sizes, near.places, strict=True):
            values = {"first": int(first), "count": int(count), "sources": 3, "lift": self._lift}
            for face in self._surfels.faces(PointLight(triple(place), falloff="inverse-square")):
                cube = {"position": face["pointLight.position"], "positionLow": face["pointLight.positionLow"]}
                for (places, normals), target in zip(self._receivers, targets, strict=True):
                    target.use()
                    for unit, texture in enumerate((places, normals, self._surfels.maps.heights[0], self._sources)):
                        texture.use(unit)
                    gl.enable_only(gl.BLEND)
                    gl.blend_equation, gl.blend_func = gl.FUNC_ADD, (gl.ONE, gl.ONE)
                    self._programs.run(
                        "deep_framebuffer_near.frag", {}, {**face, **cube, **values, "receivers": 0, "normals": 1, "heights": 2}
                    )
