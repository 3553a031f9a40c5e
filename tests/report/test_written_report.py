"""A report: every file is there and shows something, holes and gaps are said, and equal inputs give equal files."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.io.image import encode_srgb, read_image, size_of
from srbf.lights import PointLight
from srbf.methods import relight
from srbf.methods.eigen_map import EigenMap
from srbf.methods.relighting_map import RelightingMap
from srbf.report import write_report
from srbf.report.canvas import UNCOVERED, shown, shown_signed
from srbf.report.contact_sheet import difference_gain
from srbf.report.point_lights import demonstration_point_lights, stage_of
from srbf.report.subject import EXPOSURE_LEVEL, EXPOSURE_QUANTILE, gather
from srbf.sphere import farthest_points

ALWAYS = {"contact_sheet.png", "sum_of_maps.png", "centers.png", "r_curve.png", "abrdf_tiles.png"}
POINT_LIGHTS = {"point_light.png", "point_strip.png", "spot_strip.png"}
MakeCapture = Callable[..., Capture]
PAGES = {"report.md", "index.html"}
BYTE = 1 / 255
COMPARED = (RelightingMap(k=4, spread=0.9, ridge=0.01), EigenMap(components=4))
MAX_ANIMATION_BYTES = 2 << 20


@dataclass(frozen=True)
class Case:
    """A fitted capture and its evaluation."""

    capture: Capture
    asset: Asset
    evaluation: dict[str, Any]

    def write(self, folder: Path, **options: Any) -> Path:
        return write_report(self.asset, self.capture, folder, evaluation=self.evaluation, **{"methods": COMPARED, **options})


def fitted(capture: Capture, k: int = 12) -> Case:
    asset = RelightingMap(k=k, spread=0.7).encode(capture)
    return Case(capture, asset, evaluate(asset, capture))


@pytest.fixture(scope="module")
def full(make_capture: MakeCapture) -> Case:
    return fitted(make_capture())


@pytest.fixture(scope="module")
def holed(make_capture: MakeCapture) -> Case:
    return fitted(make_capture(holes=True, domain="sphere", train=60), k=3)


@pytest.fixture(scope="module")
def report(full: Case, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    page = full.write(folder, timings={"fit": 1.25})
    assert page == folder / "index.html"
    return folder


def assert_shows_something(path: Path) -> None:
    pixels = read_image(path, 3)
    assert min(pixels.shape[:2]) > 200
    assert pixels.std() > 0.02, f"{path.name} is nearly constant"


@pytest.mark.slow
def test_a_report_leaves_every_file(report: Path) -> None:
    found = {path.name for path in report.iterdir()}
    assert found >= ALWAYS | POINT_LIGHTS | PAGES
    assert found - (ALWAYS | POINT_LIGHTS | PAGES) <= {"animation.webp", "animation.gif"}
    for name in ALWAYS | POINT_LIGHTS:
        assert_shows_something(report / name)


@pytest.mark.slow
def test_the_animation_moves_and_is_small(report: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    path = next(report.glob("animation.*"))
    assert path.stat().st_size < MAX_ANIMATION_BYTES
    with image.open(path) as animation:
        assert 2 <= animation.n_frames <= 24
        first = np.asarray(animation.convert("RGB"), np.float64)
        animation.seek(animation.n_frames // 3)
        assert np.abs(np.asarray(animation.convert("RGB")) - first).mean() > 2


@pytest.mark.slow
def test_the_page_holds_all_its_figures_and_the_markdown_names_its_files(report: Path) -> None:
    html, markdown = (report / "index.html").read_text(), (report / "report.md").read_text()
    sources = re.findall(r'src="([^"]*)"', html)
    assert len(sources) > len(ALWAYS | POINT_LIGHTS) and all(source.startswith("data:image/") for source in sources)
    assert not re.search(r"href=|url\(|@import|<script|<link", html)
    for name in ALWAYS | POINT_LIGHTS:
        assert f"]({name})" in markdown and name not in html
    for text in (re.sub(r"data:[^\"]*", "", html), markdown):
        assert "http" not in text and str(report.parent) not in text
        for fact in (
            "condition number",
            "1.25",
            "psnr pooled",
            "holdout",
            "relative residual",
            "bytes per texel",
            "occluder beyond the light",
        ):
            assert fact in text


@pytest.mark.slow
def test_equal_inputs_give_equal_files(full: Case, report: Path, tmp_path: Path) -> None:
    full.write(tmp_path, timings={"fit": 1.25})
    for path in sorted(report.iterdir()):
        assert path.read_bytes() == (tmp_path / path.name).read_bytes(), path.name


@pytest.mark.slow
def test_holes_are_gray_and_a_sphere_has_two_discs(holed: Case, tmp_path: Path) -> None:
    holed.write(tmp_path)
    for name in ALWAYS | POINT_LIGHTS:
        assert_shows_something(tmp_path / name)
    sheet = read_image(tmp_path / "contact_sheet.png", 3)
    assert (np.abs(sheet - UNCOVERED).max(axis=2) < 2 * BYTE).mean() > 0.05  # a twelfth and three rows of each image are not covered
    assert (sheet.max(axis=2) < 0.2).any()  # the value 50 in the holes did not set the exposure
    height, width = size_of(tmp_path / "centers.png")
    assert height > width  # two rows of discs


@pytest.mark.slow
def test_without_holdout_lights_the_report_says_what_it_compares(make_capture: MakeCapture, tmp_path: Path) -> None:
    bare = fitted(make_capture(size=(12, 16), train=30, validation=0, holdout=0, geometry=False), k=4)
    (tmp_path / "point_strip.png").write_bytes(b"of an earlier report")
    bare.write(tmp_path)
    text = (tmp_path / "report.md").read_text()
    assert "neither holdout nor validation" in text and "no position map" in text
    assert {path.name for path in tmp_path.iterdir()} & POINT_LIGHTS == set()
    for name in ALWAYS:
        assert_shows_something(tmp_path / name)


@pytest.mark.lengthy
def test_given_point_lights_replace_the_derived_ones(full: Case) -> None:
    point_light = PointLight((0.2, 0.1, 2.0), a0=2.0)
    subject = gather(full.asset, full.capture, full.evaluation, [point_light])
    assert subject.points == (point_light,) and len(subject.spots) == 6


@pytest.mark.lengthy
def test_another_capture_is_refused(full: Case, holed: Case, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="evaluation of the"):
        write_report(full.asset, full.capture, tmp_path, evaluation=holed.evaluation)
    assert not any(tmp_path.iterdir())


def test_exposure_brings_the_references_to_its_level(full: Case) -> None:
    subject = gather(full.asset, full.capture, full.evaluation, None)
    assert np.quantile(subject.references * subject.gain, EXPOSURE_QUANTILE) == pytest.approx(EXPOSURE_LEVEL, rel=1e-4)
    assert subject.role == "holdout" and len(set(subject.shown)) == 6


def test_a_point_light_on_the_right_brightens_what_faces_right(full: Case) -> None:
    subject = gather(full.asset, full.capture, full.evaluation, None)
    x = full.asset.images["normal"][..., 0]
    for point_light, side in ((subject.points[0], -1), (subject.points[-1], 1)):
        assert point_light.position[0] * side > 0.5
        assert point_light.position[2] > full.asset.images["position"][..., 2].max()  # above the receivers, not among them
        image = relight(full.asset, [point_light])
        assert image[x * side > 0.5].mean() > 2 * image[x * side < -0.5].mean()


def test_point_lights_stand_in_front_of_a_wall_and_inside_a_room(full: Case) -> None:
    def asset(position: np.ndarray, normal: np.ndarray) -> Asset:
        images = {"position": position.astype(np.float32), "normal": normal.astype(np.float32)}
        return Asset(
            {**full.asset.manifest, "domain": "sphere"},
            full.asset.stored,
            full.asset.scale,
            full.asset.bias,
            full.asset.tables,
            images,
        )

    s, t = np.meshgrid(np.linspace(-2, 2, 16), np.linspace(0, 3, 12))
    everywhere = np.ones((12, 16), bool)
    wall = asset(np.stack([0 * s, s, t], 2), np.broadcast_to([-1.0, 0.0, 0.0], (12, 16, 3)))
    points, _ = demonstration_point_lights(wall, everywhere, None)
    assert all(light.position[0] < -0.3 for light in points)
    angle = np.linspace(0, 2 * np.pi, 16)
    ring = np.stack([np.broadcast_to(3 * np.cos(angle), s.shape), np.broadcast_to(3 * np.sin(angle), s.shape), t], 2)
    inward = -ring * [1 / 3, 1 / 3, 0]
    room = asset(ring, inward)
    assert stage_of(room, everywhere).inside
    points, _ = demonstration_point_lights(room, everywhere, None)
    assert all(np.hypot(*light.position[:2]) < 3 and 0 < light.position[2] < 3 for light in points)


def test_farthest_points_are_spread() -> None:
    line = np.linspace(0, 1, 11)[:, None]
    assert farthest_points(line, 3) == [10, 0, 5]
    assert len(farthest_points(line, 50)) == 11


def test_display_values() -> None:
    linear = np.array([[[0.0, 0.25, 2.0], [np.nan, 0, 0]], [[0.5, 0.5, 0.5], [-1, 0, 0]]], np.float32)
    display = shown(linear, 2.0, np.array([[True, True], [False, True]]))
    assert np.allclose(display[0, 0], encode_srgb(np.array([0, 0.5, 1.0])))
    assert (display[0, 1] == UNCOVERED).all() and (display[1, 0] == UNCOVERED).all() and (display[1, 1] == 0).all()
    assert np.allclose(shown_signed(np.array([[[-2.0, 0, 1]]], np.float32), 2.0), [[[0, 0.5, 0.75]]])
    assert difference_gain(np.full(9, 0.2), 1.0) == 4 and difference_gain(np.zeros(9), 1.0) == 64


@pytest.mark.slow
def test_the_pages_numbers_are_the_evaluations(full: Case, report: Path) -> None:
    html = (report / "index.html").read_text()
    for role in ("train", "validation", "holdout"):
        error = full.evaluation[role]
        row = next(line for line in html.splitlines() if line.startswith(f"<tr><td>{role}</td>"))
        for shown_as in (f"{error['rmse']:.4g}", f"{100 * error['relative_rmse']:.2f} %", f"{error['psnr']:.2f} dB"):
            assert f">{shown_as}<" in row
    one = next(line for line in html.splitlines() if line.startswith('<tr><td>1</td><td class="number">8</td>'))
    assert f">{full.evaluation['holdout']['psnr']:.2f} dB<" in one  # every held-out light alone: the same mean by another way


@pytest.mark.slow
def test_the_curve_of_the_samples_is_shown_where_the_bake_chose_them(full: Case, tmp_path: Path) -> None:
    curve = [{"samples": n, "relative_rmse": e, "noise": 0.1} for n, e in ((1, 0.31), (2, 0.25), (4, 0.248))]
    manifest = {**full.capture.manifest, "source": {"validation_curve": curve}}
    page = replace(full, capture=replace(full.capture, manifest=manifest)).write(tmp_path)
    text = page.read_text()
    assert "stopped at 4 samples" in text
    assert "stopped at" not in full.write(tmp_path / "without").read_text()
