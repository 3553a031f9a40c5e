"""Light from the brightest surfels of a pool on receivers, by passes of the GPU: what they see of a cell is drawn once, and kept."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32
from srbf.gl.deep_framebuffer import folded
from srbf.gl.programs import Programs
from srbf.lights import PointLight, triple
from srbf.visibility.gl_resources import Resources, Target
from srbf.visibility.near_sources import MOST, NearReceivers, NearSources, lift_above
from srbf.visibility.surfel_light import SurfelLight

if TYPE_CHECKING:
    import moderngl

SLOTS = 64  # cells whose visibility is kept, at most
ENTRIES = 2 * MOST  # surfels, each by two cells


@dataclass(frozen=True, eq=False)
class _Receivers:
    """Places less the center and normals, one texel for each, and how much each sees of the cells, one slot below the other."""

    places: moderngl.Texture
    normals: moderngl.Texture
    seen: Target

    @property
    def rows(self) -> int:
        """Texels that a slot is high."""
        return self.places.size[1]


class NearPasses:
    """What `NearSources` lay on several sets of receivers, each into a texture with one texel for each receiver.

    Parameters
    ----------
    programs
        Of the context, which is current whenever `draw` is called.
    surfels
        Whose shadow cube is drawn.
    places
        Where each cell is seen, m.
    receivers
        Places (m) and unit normals of each set.
    texture_size
        Most texels of a side.
    traced
        What says how much all receivers see of a cell, in their order; None: shadow cubes about the cells.
    """

    def __init__(
        self,
        programs: Programs,
        surfels: SurfelLight,
        places: Float32[ndarray, "C 3"],
        receivers: list[tuple[Float[ndarray, "_ 3"], Float[ndarray, "_ 3"]]],
        texture_size: int,
        traced: NearReceivers | None = None,
    ) -> None:
        self._programs, self._surfels, self._places, self._traced = programs, surfels, places, traced
        self._counts = [len(own) for own, _ in receivers]
        resources = Resources(programs.context)
        programs.resources.callback(resources.close)
        self._lift = lift_above(np.concatenate([own for own, _ in receivers]))
        images = [
            [folded(np.column_stack([values, 0 * values[:, :1]]).astype(np.float32)) for values in (own - surfels.center, normals)]
            for own, normals in receivers
        ]
        self._slots = min(SLOTS, texture_size // max(len(image) for image, _ in images))
        self._receivers = [
            _Receivers(
                resources.texture(own),
                resources.texture(normals),
                resources.target((own.shape[1], self._slots * len(own)), 1, "f1"),
            )
            for own, normals in images
        ]
        self._sources = resources.texture(np.zeros((3, ENTRIES, 4), np.float32))
        self._kept: OrderedDict[int, int] = OrderedDict()  # slots of cells
        self.drawn = 0  # cells whose visibility was drawn

    def draw(self, near: NearSources, targets: list[moderngl.Framebuffer]) -> None:
        """Add the light of `near` into a target for each set; blending is left on and additive."""
        gl: Any = self._programs.context
        sending = near.by_cell()
        for first in range(0, len(sending), self._slots):
            part = sending[first : first + self._slots]
            slots = self._slots_of([cell for cell, _, _ in part])
            count = self._write(near, part, slots)
            gl.enable_only(gl.BLEND)
            gl.blend_equation, gl.blend_func = gl.FUNC_ADD, (gl.ONE, gl.ONE)
            for receivers, target in zip(self._receivers, targets, strict=True):
                target.use()
                for unit, texture in enumerate((receivers.places, receivers.normals, receivers.seen[0], self._sources)):
                    texture.use(unit)
                units = {"receivers": 0, "normals": 1, "seen": 2, "sources": 3}
                self._programs.run("deep_framebuffer_near.frag", {}, {**units, "count": count, "rows": receivers.rows})

    def _write(self, near: NearSources, sending: list[tuple[int, ndarray, ndarray]], slots: list[int]) -> int:
        """The surfels that cells send light from into the texture of sources; how many."""
        members = np.concatenate([own for _, own, _ in sending])
        slot = np.repeat(slots, [len(own) for _, own, _ in sending])
        own = near.geometry.at(members)
        sources = np.zeros((3, ENTRIES, 4), np.float32)
        sources[0, : len(members)] = np.column_stack([own.places - self._surfels.center, own.areas])
        sources[1, : len(members)] = np.column_stack([own.normals, slot])
        sources[2, : len(members), :3] = np.concatenate([radiosity for _, _, radiosity in sending])
        self._sources.write(sources)
        return len(members)

    def _slots_of(self, cells: list[int]) -> list[int]:
        """Where it is kept what receivers see of each cell; drawn for those that are new, in place of those not asked for longest."""
        for cell in cells:
            if cell in self._kept:
                self._kept.move_to_end(cell)
        new = [cell for cell in cells if cell not in self._kept]
        for cell in new:
            self._kept[cell] = len(self._kept) if len(self._kept) < self._slots else self._kept.popitem(last=False)[1]
        self.drawn += len(new)
        if self._traced is None:
            for cell in new:
                self._draw_seen(cell, self._kept[cell])
        else:
            for cell, seen in zip(new, self._traced.seen(new), strict=True):
                self._write_seen(seen, self._kept[cell])
        return [self._kept[cell] for cell in cells]

    def _draw_seen(self, cell: int, slot: int) -> None:
        """What all receivers see of a cell, through the faces of a shadow cube about its place."""
        gl: Any = self._programs.context
        for face in self._surfels.faces(PointLight(triple(self._places[cell]), falloff="inverse-square")):
            cube = {"position": face["pointLight.position"], "positionLow": face["pointLight.positionLow"]}
            for receivers in self._receivers:
                target = receivers.seen[1]
                target.use()
                gl.viewport = (0, slot * receivers.rows, receivers.places.size[0], receivers.rows)
                for unit, texture in enumerate((receivers.places, receivers.normals, self._surfels.maps.heights[0])):
                    texture.use(unit)
                gl.enable_only(gl.NOTHING)
                units = {"receivers": 0, "normals": 1, "heights": 2, "lift": self._lift, "first": slot * receivers.rows}
                self._programs.run("deep_framebuffer_seen.frag", {}, {**face, **cube, **units})

    def _write_seen(self, seen: Bool[ndarray, " R"], slot: int) -> None:
        """What all receivers see of a cell, as rays say."""
        for receivers, own in zip(self._receivers, np.split(seen, np.cumsum(self._counts)[:-1]), strict=True):
            image = folded(np.where(own, 255, 0).astype(np.uint8)[:, None])
            receivers.seen[0].write(image.tobytes(), viewport=(0, slot * receivers.rows, *receivers.places.size), alignment=1)
