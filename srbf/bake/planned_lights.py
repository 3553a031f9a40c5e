"""The lights of a bake, one after the other: their roles, files and samples' seeds."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Literal

from srbf.bake.light_sets import PlacedLight
from srbf.captured_light import LightKind, Role
from srbf.receiver_share import Share

Rendered = Literal["response", "direct", "indirect", "denoised", "toward"]  # images of a light that a worker renders


@dataclass(frozen=True)
class PlannedLight:
    """A light to bake: index in the capture, what and where it is, role, samples per texel, seed of its noise.

    `parts`: which images the worker renders of it, the one that the capture keeps first; `direct` is kept in a file of its own.
    `share`: the texels that its images have; None: all.
    """

    index: int
    placed: PlacedLight
    role: Role
    samples: int
    seed: int
    parts: tuple[Rendered, ...] = ("response",)
    gloss: int | None = None
    share: Share | None = None

    @property
    def place(self) -> tuple[float, float, float]:
        """Unit direction or position (m), by which lights are spread over the time of a bake; 0 of named lights."""
        return self.placed.place

    @property
    def kind(self) -> LightKind:
        return self.placed.kind

    @property
    def part(self) -> float:
        """Of the texels, about, that its images have."""
        return 1.0 if self.share is None else 1 / self.share.step**2

    @property
    def has_direct(self) -> bool:
        """Whether its direct light is kept apart."""
        return "direct" in self.parts

    @property
    def file(self) -> str:
        return f"lights/{self.index:04d}.exr"

    @property
    def direct_file(self) -> str:
        """The direct light that an indirect capture's image lacks."""
        return f"direct/{self.index:04d}.exr"

    @property
    def harmonics_files(self) -> tuple[str, ...]:
        """The images of its radiance's harmonics; none where it is captured toward one viewer."""
        count = 0 if self.gloss is None else (self.gloss + 1) ** 2
        return tuple(f"harmonics/{self.index:04d}_{k:02d}.exr" for k in range(count))


def noise_seed(seed: int, light: int, sampling_pass: int = 0) -> int:
    """Cycles' seed for one image: a hash, so that no two lights share their noise and a fit can average it."""
    digest = hashlib.blake2b(f"{seed}:{light}:{sampling_pass}".encode(), digest_size=4).digest()
    return int.from_bytes(digest, "big") & 0x7FFFFFFF
