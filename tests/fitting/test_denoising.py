"""Denoising by validation lights: where the error falls, and nowhere else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NoReturn, cast

import numpy as np
import pytest
from made_lightmaps import floor_capture

from srbf.asset import Asset
from srbf.capture import Capture, InMemoryCapture
from srbf.captured_light import LightKind
from srbf.encode.denoised_capture import DenoisedCapture
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.fitting import denoising
from srbf.fitting.denoising import Denoise, filtered
from srbf.fitting.options import encode
from srbf.methods.eigen_map import EigenMap
from srbf.methods.protocol import FitRun
from srbf.methods.relighting_map import RelightingMap

Make = Callable[..., Capture]
METHOD = EigenMap(components=4, spread=0.5, ridge=1e-3)


def fitted(capture: Capture, denoise: Denoise, said: list[str]) -> Asset:
    return encode(METHOD, capture, FitRun(say=said.append), denoise=denoise)


def never(*_: object) -> NoReturn:
    raise AssertionError("no rows are solved")


def held_out(asset: Asset, capture: Capture) -> float:
    return float(evaluate(asset, capture, roles=("holdout",))["holdout"]["relative_rmse"])


def same(first: Asset, second: Asset) -> bool:
    return bool((first.stored == second.stored).all())


@pytest.mark.slow
def test_a_noisy_lightmap_gains_and_says_so(make_capture: Make) -> None:
    capture, said = floor_capture(make_capture, 0.4), list[str]()
    auto, off = fitted(capture, "auto", said), fitted(capture, "off", said)
    assert len(said) == 1 and said[0].startswith("denoised: validation lights of a sample gain")
    assert auto.manifest["source"]["fit"]["denoised"] is True and "denoised" not in off.manifest["source"]["fit"]
    assert held_out(auto, capture) < 0.8 * held_out(off, capture)
    assert same(auto, fitted(capture, "on", said)) and same(off, METHOD.encode(capture))


@pytest.mark.lengthy
@pytest.mark.parametrize("grain", [0.0, 0.3], ids=["smooth", "grain that is true"])
def test_a_lightmap_without_noise_is_left_as_it_is(make_capture: Make, grain: float) -> None:
    capture, said = floor_capture(make_capture, 0.0, grain=grain), list[str]()
    auto = fitted(capture, "auto", said)
    assert said[0].startswith("not denoised: ")
    assert same(auto, fitted(capture, "off", said)) and len(said) == 1


@pytest.mark.lengthy
def test_captures_that_it_is_not_for_are_left_alone(make_capture: Make) -> None:
    capture, said = floor_capture(make_capture, 0.4), list[str]()
    view = replace(capture, manifest={**capture.manifest, "receiver": {"kind": "view", "camera": "Camera"}})
    unvalidated = capture.with_roles([None if light.role == "validation" else light.role for light in capture.lights])
    for other in (view, unvalidated):
        assert same(fitted(other, "auto", said), fitted(other, "off", said))
    assert not said
    with pytest.raises(InputError, match=r"expected a lightmap .* found view; leave it out"):
        fitted(view, "on", said)
    with pytest.raises(Exception, match="auto"):  # where annotations are checked, by them
        fitted(view, cast(Any, "yes"), said)
    with pytest.raises(InputError, match="found `dask`"):
        encode(RelightingMap(k=4, ridge=0.1, spread=0.5), capture, FitRun(solve_rows=never), denoise="on")


def test_patches_are_denoised_and_point_lights_are_not(make_capture: Make) -> None:
    capture = floor_capture(make_capture, 0.4)

    def under(kind: LightKind) -> Capture:
        return replace(capture, lights=tuple(replace(light, kind=kind) for light in capture.lights))

    found = filtered(METHOD, under("patch"), "on")
    assert isinstance(found, DenoisedCapture) and (found.image(3) != capture.image(3)).any()
    points = under("point")
    assert filtered(METHOD, points) is points
    with pytest.raises(InputError, match="found point lights; leave it out"):
        filtered(METHOD, points, "on")


def test_tiles_of_a_large_lightmap_tell_as_well(make_capture: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in {"FEW_TEXELS": 200, "TRIED_TEXELS": 128, "TILE": 8, "MARGIN": 3, "TILES": 2, "FEWEST_TEXELS": 8}.items():
        monkeypatch.setattr(denoising, name, value)
    texels, inside = denoising._tiles(np.ones((64, 64), bool))
    assert 128 <= inside.sum() < len(texels) < 1500
    assert len(np.unique(texels // 64)) <= 32, "of two strips of rows"
    said: list[str] = []
    noisy, clean = floor_capture(make_capture, 0.4), floor_capture(make_capture, 0.0, name="clean")
    assert isinstance(filtered(METHOD, noisy, say=said.append), DenoisedCapture)
    assert filtered(METHOD, clean, say=said.append) is clean
    assert [line.partition(":")[0] for line in said] == ["denoised", "not denoised"]
    chosen, whole = filtered(METHOD, noisy), filtered(METHOD, noisy, "on")
    assert isinstance(chosen, DenoisedCapture) and isinstance(whole, DenoisedCapture)
    assert (chosen.rows != whole.rows).nnz == 0, "tiles choose, but what other texels show guides the filter, too"


def test_texels_that_fill_no_tiles_are_tried_all(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(denoising, "FEW_TEXELS", 200)
    thin = np.zeros((64, 64), bool)
    thin[::16] = True  # in the margins of all tiles
    texels, inside = denoising._tiles(thin)
    assert len(texels) == thin.sum() and inside.all()


def test_nothing_covered_is_left_to_the_fit_to_refuse(make_capture: Make) -> None:
    capture = floor_capture(make_capture, 0.4)
    loaded = capture.load()
    assert isinstance(loaded, InMemoryCapture)
    bare = replace(loaded, covered=np.zeros((capture.height, capture.width), np.float32))
    assert filtered(METHOD, bare) is bare
