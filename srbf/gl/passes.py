"""What the GL passes of a method offer the relighter."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from numpy import ndarray

from srbf.arrays import Float64
from srbf.asset import Asset
from srbf.gl.context import Limits
from srbf.gl.programs import Programs
from srbf.gl.textures import AssetTextures
from srbf.lights import Light, PointLight

if TYPE_CHECKING:
    import moderngl


class Passes(ABC):
    """Passes over one asset; each adds to the target in use. Lights are in the asset's frame.

    `formula`: weights of point lights by formula instead of the asset's table, where the method has one.
    """

    @abstractmethod
    def __init__(self, asset: Asset, programs: Programs, textures: AssetTextures, limits: Limits, formula: bool = False) -> None: ...

    @abstractmethod
    def check_point_lights(self) -> None:
        """InputError where the shaders cannot weigh the asset's functions at point and spot lights."""

    @abstractmethod
    def distant(self, weights: Float64[ndarray, "F 3"], units: int | None) -> None:
        """All directional and environment lights; `units` layers per pass as plain textures, or all that uniforms hold."""

    @abstractmethod
    def weighted(self, weights: moderngl.Texture) -> None:
        """All directional and environment lights, by weights that are on the GPU."""

    @abstractmethod
    def point_lights(self, lights: Sequence[PointLight], weights: Float64[ndarray, "F 3"], units: int | None) -> None:
        """Point and spot lights, and the distant lights' `weights` with the first of them; `units` layers per pass."""

    def prepare(self, lights: Sequence[Light]) -> Callable[[], None] | None:
        """A pass that adds all of the light of `lights`, so that nothing is left to project; None of methods that project.

        It may use other targets before it returns, and leaves blending as it likes.
        """
        return None
