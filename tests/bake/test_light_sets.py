"""Light sets: what flags mean, which settings exclude each other, what a resumed bake finds again."""

from __future__ import annotations

from pathlib import Path

import pytest
from made_places import BOX, places_of

from srbf.bake.light_sets import MOST_SURFELS, CloudSet, NamedSet, parse_light_set
from srbf.bake.settings import BakeSettings, Receiver, plan_lights
from srbf.errors import InputError

LIGHTMAP = Receiver("lightmap", "Floor")


def test_flags_mean_a_set() -> None:
    assert parse_light_set("surfels", (), 400, None, None, None, 25.0) == CloudSet("surfels", MOST_SURFELS, 0.2)
    assert parse_light_set("surfels", (), 400, 64, None, None, None, "cycles") == CloudSet("patches", 64)
    assert parse_light_set("named", ["Hall"], 400, None, None, None) == NamedSet(("Hall",))
    assert parse_light_set("cloud", (), 512, None, 0.5, "0,0,0,2,2,2") == CloudSet("cloud", 512, 0.5, BOX)
    assert parse_light_set("patches", (), 512, None, None, None) == CloudSet("patches", 512)
    assert parse_light_set("patches", (), 512, 64, None, None).count == 64  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("bulbs", (), 400, None, None, None), "named, cloud, patches, surfels, gather or point:SPACING, found 'bulbs'"),
        (("named", (), 400, 5, None, None), "`light_set=named` without `patches`"),
        (("cloud", ("Hall",), 400, None, None, None), "`light_group` with `light_set=named`"),
        (("patches", (), 400, None, None, None, 8.0), "`surfels_per_m2` with `light_set=surfels`"),
        (("surfels", (), 400, 5, None, None), "`light_set=surfels` without `patches`"),
        (("patches", (), 400, None, 0.5, None), "`grid` with `light_set=cloud`"),
        (("surfels", (), 400, None, None, None, 8.0, "cycles"), "a count of `patches`, found it with `surfels_per_m2`"),
        (("cloud", (), 400, None, None, None, None, "cycles"), "`operator=cycles` with `light_set=surfels`"),
        (("cloud", (), 400, None, None, "0,0,0,-1,1,1"), "each first value the smaller"),
    ],
)
def test_other_flags_are_refused(arguments: tuple, words: str) -> None:
    with pytest.raises(InputError, match=words):
        parse_light_set(*arguments)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"light_set": CloudSet("patches", 4)}, "`transport=indirect`"),
        ({"light_set": NamedSet(), "keep_scene_lights": True}, "without `keep_scene_lights`"),
        ({"light_set": NamedSet(), "samples": "auto"}, "a number of `samples`"),
        ({"light_set": NamedSet(), "sun_angle": 0.1}, "without `light_list` and `sun_angle`"),
    ],
)
def test_settings_that_exclude_each_other(settings: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        BakeSettings(LIGHTMAP, **settings)


def test_lights_of_patches_are_tested_by_point_lights() -> None:
    settings = BakeSettings(
        LIGHTMAP, transport="indirect", light_set=CloudSet("patches", 4, found=places_of()), validation=2, holdout=3, holdout_samples=9
    )
    lights = plan_lights(settings)
    assert [light.placed.json() for light in lights[:4]] == [{"kind": "patch", "patch": k} for k in range(4)]
    assert [light.parts for light in lights[:4]] == [("response",)] * 4
    assert [(light.kind, light.role) for light in lights[4:]] == [("point", "validation")] * 2 + [("point", "holdout")] * 3
    assert all(light.has_direct and light.samples == 9 for light in lights[4:])
    assert {light.seed for light in lights} and len({light.seed for light in lights}) == len(lights)


def test_a_cloud_without_direct_light_renders_one_image_of_each_light() -> None:
    cloud = CloudSet("cloud", 5, found=places_of())
    apart = plan_lights(BakeSettings(LIGHTMAP, transport="indirect", light_set=cloud, validation=0, holdout=1))
    assert [light.parts for light in apart] == [("indirect",)] * 5 + [("response", "direct")]
    whole = plan_lights(BakeSettings(LIGHTMAP, light_set=cloud, validation=0, holdout=1))
    assert {light.parts for light in whole} == {("response",)}


def test_named_lights_are_all_there_are() -> None:
    named = NamedSet((), (("Desk", ("Desk",)), ("Sun", ("Sun",))))
    lights = plan_lights(BakeSettings(LIGHTMAP, light_set=named))
    assert [light.placed.json()["name"] for light in lights] == ["Desk", "Sun"] and {light.role for light in lights} == {"train"}


def test_a_set_is_found_again_by_its_key_alone(tmp_path: Path) -> None:
    known, path = CloudSet("cloud", 5, found=places_of()), tmp_path / "light_set.npz"
    known.write(path, known.key("scene", 6, 1))
    again = CloudSet("cloud", 5).read(path, known.key("scene", 6, 1))
    assert again.is_known and again.record() == known.record()
    assert not CloudSet("cloud", 5).read(path, known.key("another scene", 6, 1)).is_known
    assert not CloudSet("cloud", 5).read(tmp_path / "missing.npz", "").is_known
    path.write_bytes(path.read_bytes()[:-40])
    assert not CloudSet("cloud", 5).read(path, known.key("scene", 6, 1)).is_known


def test_what_is_not_known_yet_cannot_be_planned() -> None:
    for unknown in (NamedSet(), CloudSet("cloud", 5)):
        with pytest.raises(InputError, match="call with_light_set first"):
            plan_lights(BakeSettings(LIGHTMAP, light_set=unknown))
