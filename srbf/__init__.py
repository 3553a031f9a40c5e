"""Render a scene once under many lights, compress the results, and relight it in real time.

>>> import srbf
>>> asset = srbf.fit(capture, components=16)
>>> image = srbf.relight(asset, [srbf.DirectionalLight((0.3, 0.0, 1.0))])
>>> image.shape == (asset.height, asset.width, 3)
True

Names are imported when they are first used, so that `import srbf` takes no time. Exports for engines are `srbf.export.export`, bakes
`srbf.bake.run.Bake`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from srbf.asset import Asset
    from srbf.capture import Capture
    from srbf.errors import BakeError, ImageError, InputError, ManifestError, MissingLibraryError, OutputExistsError, SrbfError
    from srbf.evaluation.errors_by_role import evaluate
    from srbf.fitting.options import fit
    from srbf.importing.photographs import LightListImport
    from srbf.io.image import read_image, write_image
    from srbf.lights import AreaLight, DirectionalLight, EnvironmentLight, Light, NamedLight, PointLight, SphereLight, SpotLight
    from srbf.methods.clustered_eigen_map import ClusteredEigenMap
    from srbf.methods.eigen_map import EigenMap
    from srbf.methods.relighting_map import RelightingMap
    from srbf.relighting.relight import relight
    from srbf.relighting.relighter import Relighter
    from srbf.report import write_report

_MODULES = {
    "srbf.asset": ("Asset",),
    "srbf.capture": ("Capture",),
    "srbf.errors": ("BakeError", "ImageError", "InputError", "ManifestError", "MissingLibraryError", "OutputExistsError", "SrbfError"),
    "srbf.evaluation.errors_by_role": ("evaluate",),
    "srbf.fitting.options": ("fit",),
    "srbf.importing.photographs": ("LightListImport",),
    "srbf.io.image": ("read_image", "write_image"),
    "srbf.lights": (
        "AreaLight",
        "DirectionalLight",
        "EnvironmentLight",
        "Light",
        "NamedLight",
        "PointLight",
        "SphereLight",
        "SpotLight",
    ),
    "srbf.methods.clustered_eigen_map": ("ClusteredEigenMap",),
    "srbf.methods.eigen_map": ("EigenMap",),
    "srbf.methods.relighting_map": ("RelightingMap",),
    "srbf.relighting.relight": ("relight",),
    "srbf.relighting.relighter": ("Relighter",),
    "srbf.report": ("write_report",),
}
_PLACES = {name: module for module, names in _MODULES.items() for name in names}

__all__ = [
    "AreaLight",
    "Asset",
    "BakeError",
    "Capture",
    "ClusteredEigenMap",
    "DirectionalLight",
    "EigenMap",
    "EnvironmentLight",
    "ImageError",
    "InputError",
    "Light",
    "LightListImport",
    "ManifestError",
    "MissingLibraryError",
    "NamedLight",
    "OutputExistsError",
    "PointLight",
    "RelightingMap",
    "Relighter",
    "SphereLight",
    "SpotLight",
    "SrbfError",
    "evaluate",
    "fit",
    "read_image",
    "relight",
    "write_image",
    "write_report",
]


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'srbf' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
