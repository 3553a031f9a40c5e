"""A capture on disk: the transport matrix T, (P receivers, L lights, 3), stored as one image per light and read in blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy import ndarray

from srbf import schemas
from srbf.arrays import Bool, Float32, Float64, Int
from srbf.captured_light import ROLES as ROLES
from srbf.captured_light import CapturedLight, LightKind, Role
from srbf.channels import channels_of
from srbf.errors import InputError, ManifestError
from srbf.io import files
from srbf.light_images import LightImages
from srbf.receiver_images import MANIFEST, Rows

COVERED = 0.5  # a texel of at least this coverage counts in metrics and figures


@dataclass(frozen=True)
class Capture(LightImages):
    """An opened capture; images are read on request.

    Parameters
    ----------
    folder
        Holds capture.json and the images.
    manifest
        The content of capture.json.
    lights
        One per image: direction or position, role, file.

    Examples
    --------
    >>> capture.width, capture.height, len(capture.lights)
    (8, 6, 48)
    >>> capture.quantity, capture.transport, capture.kind
    ('irradiance', 'combined', 'directional')
    """

    @staticmethod
    def open(folder: Path | str) -> Capture:
        """Read and check capture.json; keys not known to this version are ignored.

        Parameters
        ----------
        folder
            Holds capture.json: what a bake or an import wrote.

        Returns
        -------
        Capture
            No image is read yet.

        Raises
        ------
        ManifestError
            In one line, where there is no capture.json or it breaks the format.

        Examples
        --------
        >>> Capture.open(folder / "capture").lights == capture.lights
        True
        """
        folder = Path(folder)
        path = folder / MANIFEST
        if not path.is_file():
            raise ManifestError(f"expected a capture with a {MANIFEST} at {folder}, found none; bake or import one first")
        manifest = files.read_json(path)
        schemas.check_version(manifest, "srbf-capture", path)
        schemas.check(manifest, "capture", str(path))
        lights = [CapturedLight.of_manifest(entry, f"light {i} in {path}") for i, entry in enumerate(manifest["lights"])]
        if "cubemap" in manifest:
            from srbf.cubemap_capture import CubemapCapture, train_lights

            lights = [*train_lights(manifest["cubemap"]), *lights]
        if not (lights or "surfels" in manifest or "gather" in manifest):
            raise ManifestError(f"expected one or more lights in {path}, found none; bake or import again")
        texels = manifest["width"] * manifest["height"]
        for i, light in enumerate(lights):
            if light.kind != lights[0].kind and (light.kind != "point" or light.role == "train"):
                raise ManifestError(
                    f"expected lights of one kind in {path}, and point lights that measure them, found {lights[0].kind} and {light.kind} "
                    "lights; split them into two captures"
                )
            if isinstance(light.region, tuple) and max(light.region) >= texels:
                raise ManifestError(f"expected receivers below {texels} in the region of light {i} in {path}, found {max(light.region)}")
            for name in light.files:
                files.inside(folder, name, path)
        terms = (manifest["harmonics"]["order"] + 1) ** 2 if "harmonics" in manifest else 0
        for i, light in enumerate(lights):
            if len(light.harmonics) != terms:
                raise ManifestError(f"expected {terms} images of harmonics of light {i} in {path}, found {len(light.harmonics)}")
        named = [file for _, file in channels_of(manifest, str(path)).values()]
        for name in [*named, *(manifest[key] for key in ("scene", "seams") if key in manifest)]:
            files.inside(folder, name, path)
        if "cubemap" in manifest:
            for key in ("bounces", "tested"):
                if key in manifest["cubemap"]:
                    files.inside(folder, manifest["cubemap"][key], path)
            return CubemapCapture(folder, manifest, tuple(lights))
        return Capture(folder, manifest, tuple(lights))

    @property
    def kind(self) -> LightKind:
        """The kind of its train lights, which are listed first; the lights that measure a fit may be point lights whatever it is. `surfel`
        where a transfer operator stands in for train lights, `pool` where a deep framebuffer does.
        """
        if "gather" in self.manifest:
            return "pool"
        if "surfels" in self.manifest:
            return "surfel"
        return self.lights[0].kind if self.lights else "directional"

    @property
    def is_cubemap(self) -> bool:
        """Whether its train lights are the texels of a cubemap, whose images are made on request."""
        return "cubemap" in self.manifest

    def require_directional(self, what: str) -> None:
        """InputError where the lights are not directional, which `what` needs."""
        if self.kind != "directional":
            raise InputError(f"expected a capture under directional lights for {what}, found {self.kind} lights in {self.folder}")

    @property
    def has_direct(self) -> bool:
        """Whether every light has a direct image, so that the combined response can be computed."""
        return self.has_direct_of(ROLES)

    def has_direct_of(self, roles: Sequence[Role]) -> bool:
        """Whether every light of the roles has a direct image."""
        return all(light.direct is not None for light in self.lights if light.role in roles)

    def combined(self, roles: Sequence[Role] = ROLES) -> Capture:
        """The same capture with the direct light added to every image; itself where it is combined.

        Parameters
        ----------
        roles
            Whose lights must have a direct image; images of others cannot be read.

        Returns
        -------
        Capture
            Of `transport` combined.

        Raises
        ------
        ManifestError
            Where an indirect capture lacks direct images.

        Examples
        --------
        >>> capture.combined() is capture
        True
        """
        if self.transport == "combined":
            return self
        if not self.has_direct_of(roles):
            raise ManifestError(f"expected a direct image of every light in {self.folder}, found lights without; bake it again")
        return CombinedCapture(self.folder, {**self.manifest, "transport": "combined"}, self.lights, operators=self.operators)

    def indices(self, role: Role) -> list[int]:
        """Indices of the lights of a role, in order.

        Parameters
        ----------
        role
            `train`: fitted. `validation`: random lights that choices look at. `holdout`: random lights that measure the error.

        Returns
        -------
        list
            Of integers, from 0 to the number of lights; empty where the capture has no such light.

        Examples
        --------
        >>> len(capture.indices("train")), capture.indices("validation"), capture.indices("holdout")[:2]
        (40, [], [40, 41])
        """
        return [i for i, light in enumerate(self.lights) if light.role == role]

    def directions(self, indices: Sequence[int] | None = None) -> Float64[ndarray, "L 3"]:
        """Unit directions from the surface to the lights.

        Parameters
        ----------
        indices
            Of lights; None: all.

        Returns
        -------
        ndarray
            (L, 3) float64, in Blender's world: z up.

        Raises
        ------
        InputError
            Where the lights are not directional.

        Examples
        --------
        >>> directions = capture.directions(capture.indices("train"))
        >>> directions.shape, bool((directions[:, 2] > 0).all())
        ((40, 3), True)
        """
        self.require_directional("directions")
        chosen = self.lights if indices is None else [self.lights[i] for i in indices]
        return np.array([light.direction for light in chosen], np.float64).reshape(-1, 3)

    def positions(self, indices: Sequence[int] | None = None) -> Float64[ndarray, "L 3"]:
        """Positions of point lights.

        Parameters
        ----------
        indices
            Of lights; None: all.

        Returns
        -------
        ndarray
            (L, 3) float64 in the world, m.

        Raises
        ------
        InputError
            Where the lights are directional.

        Examples
        --------
        >>> capture.positions()
        Traceback (most recent call last):
        srbf.errors.InputError: ...
        """
        chosen = self.lights if indices is None else [self.lights[i] for i in indices]
        return np.array([light.position for light in chosen], np.float64).reshape(-1, 3)

    @property
    def gloss(self) -> int | None:
        """Order of the spherical harmonics of the viewer's direction; None where radiance was captured toward one viewer alone."""
        return self.manifest["harmonics"]["order"] if "harmonics" in self.manifest else None

    @property
    def gloss_terms(self) -> int | None:
        """How many terms of its receivers' gloss a bake under a cubemap was asked for; None where it knows no gloss."""
        gloss = self.manifest.get("cubemap", {}).get("gloss")
        return None if gloss is None else int(gloss["terms"])

    def of_harmonics(self) -> Capture:
        """A capture whose lights are the harmonics of this one's, light by light, K of each: T of K L columns."""
        lights = (replace(light, file=file, direct=None, harmonics=()) for light in self.lights for file in light.harmonics)
        manifest = {key: value for key, value in self.manifest.items() if key != "harmonics"}
        return Capture(self.folder, manifest, tuple(lights))

    def load(self, texels: Int[ndarray, " n"] | None = None) -> Capture:
        """The capture with its responses in memory: 12 bytes per receiver and light.

        Parameters
        ----------
        texels
            (n,) flat indices of receivers: they alone, as an image (1, n) with no channel but coverage. None: all receivers.

        Returns
        -------
        Capture
            Reads no image again.

        Raises
        ------
        InputError
            Where an image covers a region only.

        Examples
        --------
        >>> small = capture.load(np.array([5, 17]))
        >>> small.image(0).shape, len(small.lights)
        ((1, 2, 3), 48)
        """
        whole = np.arange(self.width * self.height) if texels is None else texels
        responses = self.sample(range(len(self.lights)), whole)
        manifest, lights = self.manifest, self.lights
        if texels is not None:
            lights = tuple(replace(light, direct=None, share=None) for light in lights)  # whole images, which no longer fit
            of_whole_images = {*self.channels, "channels", "seams"} - {"coverage"}
            manifest = {key: value for key, value in manifest.items() if key not in of_whole_images}
            manifest |= {"width": len(texels), "height": 1}
        coverage = self.coverage() if texels is None else self.coverage().reshape(1, -1)[:, texels]
        return InMemoryCapture(self.folder, manifest, lights, responses, coverage)

    def with_roles(self, roles: Sequence[Role | None]) -> Capture:
        """The same images with other roles.

        Parameters
        ----------
        roles
            One per light; lights of role None are left out.

        Returns
        -------
        Capture
            Of the lights that have a role, in order.

        Examples
        --------
        >>> half = capture.with_roles(["train" if i % 2 == 0 else "holdout" for i in range(48)])
        >>> len(half.indices("train")), len(half.indices("holdout"))
        (24, 24)
        """
        chosen = [i for i, role in enumerate(roles) if role is not None]
        lights = tuple(replace(self.lights[i], role=role) for i in chosen if (role := roles[i]) is not None)
        return self._of(lights, chosen)

    def _of(self, lights: tuple[CapturedLight, ...], chosen: Sequence[int]) -> Capture:
        return replace(self, lights=lights)


@dataclass(frozen=True, eq=False)
class InMemoryCapture(Capture):
    """A capture whose responses (P, L, 3) are in memory, with its coverage."""

    responses: Float32[ndarray, "P L 3"]
    covered: Float32[ndarray, "H W"]

    def image(self, index: int) -> Float32[ndarray, "H W 3"]:
        return self._stored(index).reshape(self.height, self.width, 3)

    def _stored_type(self, indices: Sequence[int]) -> np.dtype:
        return np.dtype(np.float32)

    def sample(self, indices: Sequence[int], texels: Int[ndarray, " n"]) -> Float32[ndarray, "n L 3"]:
        return self.responses[np.ix_(texels, np.asarray(indices, np.int64))]

    def channel(self, name: str) -> Float32[ndarray, "H W C"] | None:
        return self.covered[:, :, None] if name == "coverage" else super().channel(name)

    def coverage(self) -> Float32[ndarray, "H W"]:
        return self.covered

    def _stored(self, index: int, rows: Rows = None) -> Float32[ndarray, "n 3"]:
        if rows is None:
            return self.responses[:, index]
        return np.concatenate([self.responses[begin * self.width : end * self.width, index] for begin, end in rows])

    def _of(self, lights: tuple[CapturedLight, ...], chosen: Sequence[int]) -> Capture:
        return replace(self, lights=lights, responses=self.responses[:, list(chosen)])


class CombinedCapture(Capture):
    """An indirect capture whose images have their direct light added."""

    def image(self, index: int) -> Float32[ndarray, "H W 3"]:
        self.require_whole([index])
        return self._stored(index).reshape(self.height, self.width, 3)

    def _stored_type(self, indices: Sequence[int]) -> np.dtype:
        return np.dtype(np.float32)

    def partial_image(self, index: int) -> tuple[Float32[ndarray, "H W 3"], Bool[ndarray, "H W"]]:
        image, known = super().partial_image(index)
        direct = self.lights[index].direct
        assert direct is not None
        return (image, known) if self.lights[index].region is None else (image + self._partial(direct, known), known)

    def _stored(self, index: int, rows: Rows = None) -> Float32[ndarray, "n 3"]:
        direct = self.lights[index].direct
        assert direct is not None
        return super()._stored(index, rows).astype(np.float32) + self._rows_of(index, direct, rows)
