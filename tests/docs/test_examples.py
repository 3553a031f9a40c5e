"""The examples in the docstrings of the public functions, run as doctests on a small capture and an asset of it."""

from __future__ import annotations

import doctest
import inspect
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from made_captures import write_capture

import srbf
from srbf import light_geometry, lights, methods, sphere, unshadowed
from srbf.bake.run import Bake
from srbf.bake.settings import BakeSettings, Receiver
from srbf.export import export
from srbf.relighting.relighter import relight

pytestmark = pytest.mark.slow  # fits and relights for every example
ROOT = Path(__file__).parents[2]
BAKING = (Bake, BakeSettings, Receiver)
LIGHTS = (
    light_geometry.area_samples,
    light_geometry.attenuation,
    light_geometry.environment_samples,
    light_geometry.light_vectors,
    light_geometry.spot_cone,
    lights.moved,
    unshadowed.irradiance_from,
)
METHODS = (
    *(methods.in_asset_frame, methods.linear_response, methods.method_of, methods.outside_domain),
    *(methods.projected_weights, methods.relight, methods.responses, relight),
)
SPHERE = (sphere.fibonacci, sphere.hammersley, sphere.mean_spacing, sphere.normalize, sphere.point_set, sphere.random_directions)
NAMED = [getattr(srbf, name) for name in srbf.__all__ if not name.endswith("Error") and name != "Light"]
PUBLIC = [srbf, export, *NAMED, *BAKING, *LIGHTS, *METHODS, *SPHERE]


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    """What the examples may name besides srbf's own names: `capture`, `asset`, `np` and a `folder` that holds both."""
    folder = tmp_path_factory.mktemp("examples")
    slopes = np.random.default_rng(0).normal(size=(6, 8, 3, 3))
    position = np.stack(np.meshgrid(np.arange(8.0), np.arange(6.0), [0.0]), axis=-1)[:, :, 0].astype(np.float32)
    capture = write_capture(folder / "capture", lambda d: np.maximum(1 + slopes @ d, 0), lights=40, position=position)
    asset = srbf.fit(capture, k=9)
    asset.save(folder / "asset")
    own = {name: getattr(srbf, name) for name in srbf.__all__}
    return {**own, "np": np, "capture": capture, "asset": asset, "folder": folder}


@pytest.mark.parametrize("member", PUBLIC, ids=lambda member: getattr(member, "__name__", str(member)))
def test_examples_run(member: object, known: dict[str, object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    found = doctest.DocTestFinder(recurse=not inspect.ismodule(member)).find(member, getattr(member, "__name__", "srbf"), globs=dict(known))
    for test in found:
        runner.run(test)
    assert runner.failures == 0


def test_every_public_function_has_an_example() -> None:
    functions = [member for member in PUBLIC if inspect.isfunction(member)]
    assert functions and [f.__name__ for f in functions if ">>> " not in (f.__doc__ or "")] == []


def test_the_readme_runs_from_a_capture(
    known: dict[str, object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    section = (ROOT / "README.md").read_text(encoding="utf-8").partition("## From Python\n")[2]
    shown = re.search("```python\n(.*?)```", section, re.DOTALL)
    assert shown is not None
    shutil.copytree(Path(str(known["folder"])) / "capture", tmp_path / "capture")
    monkeypatch.chdir(tmp_path)
    exec(shown[1], {})
    assert float(capsys.readouterr().out) > 20  # dB
    assert srbf.read_image(Path("relit.exr")).shape == (6, 8, 3)


def test_names_are_imported_when_used() -> None:
    for name in srbf.__all__:  # none is hidden by a package of its name
        assert not inspect.ismodule(getattr(srbf, name)), name
    assert set(srbf.__all__) <= set(dir(srbf)) and srbf.fit.__module__ == "srbf.fitting.options"
    with pytest.raises(AttributeError, match="no attribute 'fti'"):
        srbf.fti  # noqa: B018
