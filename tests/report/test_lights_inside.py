"""Reports on lights inside a scene: the map of errors over places, the numbers of the evaluation, motion, and what is left out."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_rooms import Room, room_of_patches
from typer.testing import CliRunner

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cli import app
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.methods.light_cloud import LightCloud
from srbf.methods.relighting_map import RelightingMap
from srbf.report import write_report
from srbf.report.by_place import TALLEST, WIDTH, arrange
from srbf.report.subject import gather

pytest.importorskip("embreex")
pytestmark = pytest.mark.slow
TESTED = 9
DIRECTIONS_ONLY = ("By direction", "ABRDF", "Centers and lights", "The curve R", "Light functions", "elevation", "azimuth")


@dataclass(frozen=True)
class Case:
    """A fitted capture, both on disk, and its evaluation."""

    capture: Capture
    asset: Asset
    folder: Path
    evaluation: dict[str, Any]


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Case:
    folder = tmp_path_factory.mktemp("room")
    capture = room_of_patches(folder / "capture", Room.box((4, 3, 2), 0.5, 0.6, (2.0, 1.0, 2.0)), 24, tested=TESTED)
    asset = LightCloud(clusters=2, components=8).encode(capture)
    asset.save(folder / "asset")
    return Case(capture, asset, folder, evaluate(asset, capture))


@pytest.fixture(scope="module")
def page(case: Case) -> str:
    page = write_report(case.asset, case.capture, case.folder / "report", evaluation=case.evaluation)
    return page.read_text()


def test_every_light_is_a_dot_in_plan_and_in_section(case: Case, page: str) -> None:
    found = re.findall(r'<circle class="spot"[^>]*><title>\(([^)]*)\) m: ([\d.]+)%</title>', page)
    assert len(found) == 2 * TESTED
    errors = {entry["file"]: entry["relative_rmse"] for entry in case.evaluation["lights"]}
    for i in case.capture.indices("holdout"):
        light = case.capture.lights[i]
        place = ", ".join(f"{value:.2f}" for value in light.position)
        assert found.count((place, f"{100 * errors[light.file]:.1f}")) == 2
    assert page.count('class="cells outline"') == 2


def test_the_numbers_are_the_evaluations(case: Case, page: str) -> None:
    errors = [entry["relative_rmse"] for entry in case.evaluation["lights"] if entry["role"] == "holdout"]
    row = next(line for line in page.splitlines() if line.startswith(f"<tr><td>holdout, {TESTED} point lights</td>"))
    for value in (case.evaluation["holdout"]["relative_rmse"], np.mean(errors), max(errors)):
        assert f">{100 * value:.1f} %<" in row


def test_what_knows_directions_only_is_left_out(case: Case, page: str) -> None:
    text = re.sub(r"data:[^\"]*", "", page)
    assert not any(words in text for words in DIRECTIONS_ONLY)
    for words in ("By place", "In motion", "table of positions", "free space", "largest relative RMSE", "bytes"):
        assert words in text
    files = {path.name for path in (case.folder / "report").iterdir()}
    assert files <= {"index.html", "report.md", "animation.webp", "animation.gif"} and len(files) >= 2
    assert "table of positions" in (case.folder / "report" / "report.md").read_text()


def test_without_tested_point_lights_the_page_says_so(case: Case, tmp_path: Path) -> None:
    roles = ["train" if light.role == "train" else None for light in case.capture.lights]
    bare = case.capture.with_roles(roles)  # type: ignore[arg-type]
    text = write_report(case.asset, bare, tmp_path, evaluation=evaluate(case.asset, bare)).read_text()
    assert "bake some with --holdout" in text and "patch " in text


def test_lights_are_ordered_by_relative_error(case: Case) -> None:
    subject = gather(case.asset, case.capture, case.evaluation, None)
    order = subject.worst_first(case.capture.indices("holdout"))
    errors = [subject.relative_of(i) for i in order]
    assert subject.by_relative and errors == sorted(errors, reverse=True) and subject.points == ()
    assert subject.light_words(order[0])[2].endswith(" m")


def test_panels_fit_the_page_and_do_not_overlap() -> None:
    for extent in ((4, 3, 2), (40, 3, 3), (2, 30, 3), (1, 1, 60)):
        (plan, section), height, width = arrange(np.zeros(3), np.array(extent, float))
        assert width <= WIDTH + 120 and max(plan.height, section.height) <= TALLEST + 1 and height < 2.5 * TALLEST
        beside, above = section.x >= plan.x + plan.width, section.y >= plan.y + plan.height
        assert beside or above
        assert plan.scale == section.scale
        across, down = plan.at(np.array([[0.0, 0.0, 0.0], extent]))
        assert np.allclose(across, [plan.x, plan.x + plan.width]) and np.allclose(down, [plan.y + plan.height, plan.y])


def test_an_asset_of_other_lights_is_refused(case: Case, tmp_path: Path) -> None:
    suns = replace(
        case.asset, manifest={**case.asset.manifest, "light_domain": "directions", "domain": "sphere", "method": RelightingMap.name}
    )
    with pytest.raises(InputError, match="directional lights, as the asset's are, found patch lights"):
        write_report(suns, case.capture, tmp_path / "report", evaluation=case.evaluation)


def test_evaluate_and_info_say_what_is_inside(case: Case) -> None:
    def ok(*arguments: object) -> str:
        done = CliRunner().invoke(app, list(map(str, arguments)))
        assert done.exit_code == 0, done.stderr
        return done.stdout

    found = json.loads(ok("evaluate", case.folder / "asset", case.folder / "capture", "--json"))
    errors = [light["relative_rmse"] for light in found["lights"] if light["role"] == "holdout"]
    assert found["holdout"]["relative_rmse_mean"] == pytest.approx(np.mean(errors)) and "mixes" not in found
    assert f"{np.mean(errors):.4f}" in ok("evaluate", case.folder / "asset", case.folder / "capture")
    facts = json.loads(ok("info", case.folder / "asset", "--json"))
    assert facts["bytes_per_texel"] == dict.fromkeys(("point", "spot", "area", "sphere", "directional", "environment"), 9)
    assert facts["patches"] == 24 and facts["light_domain"] == "cloud" and facts["position_table"]["rank"] > 0
    assert (np.array(facts["free_space"]["low"]) < facts["free_space"]["high"]).all()
    facts = json.loads(ok("info", case.folder / "capture", "--json"))
    assert facts["light_kinds"] == {"patch": 24, "point": 4 + TESTED} and facts["cells"] > 100 and "fitted_by" not in facts
    assert "point 9, spot 9" in ok("info", case.folder / "asset")
