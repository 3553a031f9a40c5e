"""What is planned before Blender starts: a sun as large as the lights stand apart."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from srbf.bake.settings import BakeSettings, Receiver
from srbf.cli.parameters import parse_sun_angle
from srbf.errors import InputError
from srbf.sphere import point_set


@pytest.mark.parametrize(("domain", "degrees"), [("sphere", 10.3), ("hemisphere", 7.4)])
def test_the_matched_sun_of_400_lights(domain: str, degrees: float) -> None:
    settings = BakeSettings(Receiver("view"), domain=domain, validation=3).with_matched_sun()
    assert np.degrees(settings.sun_angle) == pytest.approx(degrees, abs=0.05)
    assert settings.with_matched_sun() == settings
    assert json.loads(json.dumps(settings.record()))["sun_angle"] == settings.sun_angle  # bit for bit, so that a bake goes on


def test_the_matched_sun_of_a_list_looks_at_its_own_lights(tmp_path: Path) -> None:
    around_the_zenith = point_set("fibonacci", 4000, "sphere")[:100]  # as dense as 4000, where 100 of a hemisphere stand 14 degrees apart
    lines = [f"{i}.png {x} {y} {z}" for i, (x, y, z) in enumerate(around_the_zenith)]
    (tmp_path / "dense.lp").write_text("\n".join(["100", *lines]))
    settings = BakeSettings(Receiver("view"), light_list=tmp_path / "dense.lp").with_matched_sun()
    assert settings.sun_angle == pytest.approx(np.sqrt(4 * np.pi / 4000), rel=0.1)


def test_a_lone_light_gets_the_largest_sun() -> None:
    assert BakeSettings(Receiver("view"), lights=1).with_matched_sun().sun_angle == pytest.approx(np.pi)


def test_sun_angle_as_text() -> None:
    assert parse_sun_angle("auto") == "auto" and parse_sun_angle("0.1") == 0.1
    with pytest.raises(InputError, match="--sun-angle auto or a number of radians, found 'wide'"):
        parse_sun_angle("wide")
    with pytest.raises(InputError, match="sun angle"):
        BakeSettings(Receiver("view"), sun_angle=parse_sun_angle("nan"))
