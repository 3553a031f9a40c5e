"""`lights=auto`: the choice by what a probe says of costs and smoothness, and probes of small scenes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from srbf.bake.light_choice import COUNTS, GAIN, SPENT, USUAL_LIGHTS, Goal, Probe, choose_lights, probed, with_chosen_lights
from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings, Receiver
from srbf.capture import Capture
from srbf.errors import InputError

SUN = Probe({1: 0.1, 2: 0.035, 3: 0.025}, 0.09, (40, 80, 160), (0.2, 0.16, 0.13), 0.5, {1: 0.001, 2: 0.003, 3: 0.006})
SMOOTH = replace(SUN, directions=(0.01, 0.004, 0.002))
NOISY = replace(SUN, directions=(0.02, 0.01, 0.005), texel_errors={1: 1.0, 2: 2.0, 3: 3.0})


def settings(**changes: object) -> BakeSettings:
    given = {"receiver": Receiver.parse("lightmap:Plane"), "width": 48, "height": 48, "lights": 400, "samples": 1, **changes}
    return BakeSettings(**given)  # type: ignore[arg-type]


def test_the_power_is_that_of_the_errors() -> None:
    probe = replace(SUN, directions=tuple(0.4 * n**-0.3 for n in SUN.counts))
    assert probe.power == pytest.approx(0.3)
    assert replace(probe, texel_errors={1: 0.0}).error(640, 1, 1) == pytest.approx(0.4 * 640**-0.3)
    assert replace(SUN, directions=(0.1, 0.2, 0.3)).power == 0


def test_sharp_shadows_take_more_directions_at_fewer_texels() -> None:
    choice = choose_lights(SUN, Goal(seconds=60), 1, 5.0)
    assert choice.step > 1 and choice.lights > USUAL_LIGHTS
    assert choice.seconds <= SPENT * 60
    assert choice.error < SUN.error(USUAL_LIGHTS, 1, 2)


def test_noise_keeps_all_texels() -> None:
    assert choose_lights(NOISY, Goal(seconds=600), 1, 5.0).step == 1


def test_the_usual_lights_are_kept_where_others_gain_little() -> None:
    flat = replace(SUN, directions=(0.1001, 0.1, 0.0999))
    choice = choose_lights(flat, Goal(seconds=1000), 1, 5.0)
    assert (choice.lights, choice.step) == (USUAL_LIGHTS, 1)
    better = choose_lights(SUN, Goal(seconds=1000), 1, 5.0)
    assert better.error < GAIN * SUN.error(USUAL_LIGHTS, 1, 2)


def test_an_error_is_reached_in_the_least_time() -> None:
    choice = choose_lights(SUN, Goal(error=0.1), 1, 5.0)
    every = [(SUN.time(n, s, 1), n, s) for n in COUNTS for s in (1, 2, 3) if SUN.error(n, s, 1) <= 0.1]
    assert (choice.lights, choice.step) == min(every)[1:]
    assert choose_lights(SMOOTH, Goal(error=0.1), 1, 5.0).lights == COUNTS[0]
    hopeless = choose_lights(SUN, Goal(error=0.001), 1, 5.0)
    assert hopeless.error > 0.001 and hopeless.lights == COUNTS[-1]


def test_a_time_that_nothing_fits_in_takes_the_least() -> None:
    assert choose_lights(SUN, Goal(seconds=0.1), 1, 5.0).lights == COUNTS[0]


def test_bad_goals_and_settings_are_one_line(tmp_path: Path) -> None:
    for given in ({}, {"seconds": 60.0, "error": 0.1}):
        with pytest.raises(InputError, match=r"expected `time_limit` or `error` with `lights=auto`, found (neither|both)"):
            Goal(**given)
    scene = tmp_path / "scene.blend"
    for changes, words in (
        ({"receiver": Receiver.parse("vertices:Plane")}, "expected a lightmap or a view"),
        ({"samples": "auto"}, "without `samples=auto`"),
    ):
        with pytest.raises(InputError, match=words):
            with_chosen_lights(Bake(scene, tmp_path / "capture", settings(**changes)), Goal(error=0.1), False)
    with pytest.raises(InputError, match=r"expected a \.blend"):
        with_chosen_lights(Bake(scene, tmp_path / "capture", settings()), Goal(error=0.1), False)


@pytest.mark.blender
def test_a_probe_of_a_plane_knows_its_cosine(blend, tmp_path: Path) -> None:
    """A plane without shadows: the response is smooth over directions and the same at all texels."""
    probe = probed(Bake(blend("plane"), tmp_path / "capture", settings()), (1, 2, 3))
    assert probe is not None
    assert probe.directions[-1] < 0.02
    assert max(probe.texel_errors.values()) < 1e-4
    assert 0 < probe.averaged < 2
    assert all(seconds > 0 for seconds in probe.seconds.values())


@pytest.mark.blender
def test_a_probe_of_a_shadow_predicts_the_error_of_a_bake(blend, tmp_path: Path) -> None:
    said: list[str] = []
    job = Bake(blend("occluder"), tmp_path / "capture", settings(validation=0, holdout=1, holdout_samples=4))
    probe = probed(job, (1, 2, 3))
    assert probe is not None and 0.03 < probe.directions[-1] < probe.directions[0] < 1
    chosen = with_chosen_lights(job, Goal(error=0.5), False, said.append)
    assert chosen.settings.lights in COUNTS and "predicted error" in said[-1]
    assert chosen.run(Reporter())
    capture = Capture.open(tmp_path / "capture")
    assert len(capture.indices("train")) == chosen.settings.lights
    again = with_chosen_lights(job, Goal(error=0.02), False, said.append)  # what is there keeps its lights
    assert (again.settings.lights, again.settings.step) == (chosen.settings.lights, chosen.settings.step)
    assert again.run(Reporter()) is False
    assert np.isfinite(capture.image(0)).all()
