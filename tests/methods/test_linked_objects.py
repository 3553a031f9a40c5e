"""Light linking of deep framebuffers: light on the surfels of some objects alone, and the bounces that follow from it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_rooms import Room
from made_views import surfaces_of, view_of_room

from srbf import methods, relight
from srbf.asset import Asset
from srbf.bake.gather_set import FoundSurfaces
from srbf.errors import InputError, ManifestError
from srbf.light_entries import entry_of, light_of, lights_of
from srbf.light_linking import Objects
from srbf.lights import AreaLight, DirectionalLight, PointLight, SpotLight
from srbf.methods.deep_framebuffer import DeepFramebuffer
from srbf.relighting.light_rig import LightRig

pytest.importorskip("embreex")

BOX = Room.box((3, 2, 2), 0.25, 0.6)
LIGHT = PointLight((1.2, 0.7, 1.1), (1, 0.5, 0.2), falloff="inverse-square")
RED, GRAY = Objects(only=("Red",)), Objects(without=("Red",))


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    return DeepFramebuffer().encode(view_of_room(tmp_path_factory.mktemp("view") / "capture", BOX, 2000, 400))


def bounced(asset: Asset, light: Any) -> np.ndarray:
    return methods.relight(asset, [light])


@pytest.mark.lengthy
def test_bounces_are_of_what_is_lit(asset: Asset) -> None:
    """Light on the red wall alone and on all others adds up to that on all; the wall's own is red."""
    every, red, gray = (bounced(asset, replace(LIGHT, receivers=one)) for one in (None, RED, GRAY))
    covered = asset.covered
    assert red[covered].sum() + gray[covered].sum() == pytest.approx(every[covered].sum(), rel=1e-2)
    for part in (red, gray):
        assert 0 < part[covered].sum() < every[covered].sum()
    hue = (red[covered].sum(axis=0) / every[covered].sum(axis=0)).tolist()
    assert hue[0] > 1.5 * hue[1]
    assert not bounced(asset, replace(LIGHT, receivers=Objects(only=()))).any()


def test_the_asset_on_disk_knows_its_objects(asset: Asset, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    again, light = Asset.open(tmp_path / "asset"), replace(LIGHT, receivers=RED)
    assert again.manifest["gather"]["objects"] == ["Gray", "Red"]
    np.testing.assert_array_equal(bounced(again, light), bounced(asset, light))
    with LightRig(asset, "none") as rig:
        np.testing.assert_allclose(rig.picture([light]), relight(asset, [light], "none"), rtol=1e-4, atol=1e-6)
        rig.picture([replace(light, receivers=GRAY)])
        assert rig.computed == 2


def test_shaders_show_the_same(asset: Asset) -> None:
    pytest.importorskip("moderngl")
    light = replace(LIGHT, receivers=RED)
    expected = relight(asset, [light], "none")
    np.testing.assert_allclose(relight(asset, [light], "none", "gl"), expected, rtol=1e-2, atol=2e-3 * expected.max())


def test_surfels_hold_no_two_objects_where_the_scenes_lights_tell_them_apart() -> None:
    found = surfaces_of(BOX, 0.5)
    assert found.apart is None
    told = {"lights": [{"name": "Bulb", "light": {"kind": "point", "receivers": {"only": ["Red"]}}}], "left_out": [], "sun_angle": None}
    linked = replace(found, lights=json.dumps(told))
    assert linked.apart is not None and linked.checksum == found.checksum
    np.testing.assert_array_equal(linked.apart, found.objects)
    assert FoundSurfaces.of_arrays(linked.arrays()).object_names == ["Gray", "Red"]


@pytest.mark.parametrize(
    "light",
    [
        LIGHT,
        DirectionalLight((0, 0, 1), angle=0.1),
        SpotLight((0, 0, 1), direction=(0, 0, -1), inner=0.2, outer=0.4, size=0.1),
        AreaLight((0, 0, 1), u=(1, 0, 0), v=(0, 1, 0)),
    ],
)
def test_entries_hold_what_lights_choose(light: Any) -> None:
    linked = replace(light, receivers=RED, blockers=Objects(("Gray",), ("Red",)))
    entry = entry_of(linked)
    assert entry["receivers"] == {"only": ["Red"]} and entry["blockers"] == {"only": ["Gray"], "without": ["Red"]}
    assert lights_of([entry], "a file") == [linked] and light_of(entry_of(light)) == light
    assert not {"receivers", "blockers"} & set(entry_of(light))


@pytest.mark.parametrize(
    ("entry", "line"),
    [
        ({"receivers": {"only": "Red"}}, "receivers"),
        ({"receivers": {"except": ["Red"]}}, "except"),
        ({"blockers": {"without": [""]}}, "blockers"),
        ({"blockers": ["Red"]}, "blockers"),
    ],
)
def test_bad_entries_are_told_in_one_line(entry: dict[str, Any], line: str) -> None:
    with pytest.raises(ManifestError, match=line):
        lights_of([{"kind": "point", "position": [0, 0, 1], **entry}], "frames.json")


def test_unknown_objects_older_assets_and_other_methods_say_so(asset: Asset, make_asset: Any) -> None:
    light = replace(LIGHT, receivers=Objects(only=("Blue",)))
    with pytest.raises(InputError, match="among a light's receivers, found 'Blue'; it has '.*'Gray', 'Red'"):
        relight(asset, [light], "none")
    told = {key: value for key, value in asset.manifest["gather"].items() if key != "objects"}
    with pytest.raises(InputError, match="older bake; bake again"):
        relight(replace(asset, manifest={**asset.manifest, "gather": told}), [replace(LIGHT, receivers=RED)], "none")
    with pytest.raises(InputError, match="without `receivers` and `blockers` for a relighting-map asset"):
        methods.relight(make_asset(5), [light])
