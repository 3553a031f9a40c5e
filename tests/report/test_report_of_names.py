"""Reports on named lights: random mixes, every light by its name, and what is left out."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from made_names import NAMES, capture_of_names
from typer.testing import CliRunner

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cli import app
from srbf.evaluation.errors_by_role import evaluate
from srbf.evaluation.random_mixes import mix_errors
from srbf.methods.light_mix import LightMix
from srbf.methods.named_maps import NamedMaps
from srbf.report import write_report
from srbf.report.subject import gather


def ok(*arguments: object) -> str:
    done = CliRunner().invoke(app, list(map(str, arguments)))
    assert done.exit_code == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With `capture` and `asset`."""
    folder = tmp_path_factory.mktemp("names")
    LightMix(clusters=2, components=3).encode(capture_of_names(folder / "capture")).save(folder / "asset")
    return folder


@pytest.mark.slow
def test_the_page_shows_mixes_and_names(folder: Path) -> None:
    ok("report", folder / "asset", folder / "capture", "-o", folder / "page.html")
    page = (folder / "page.html").read_text()
    text = re.sub(r"data:[^\"]*", "", page)
    errors = mix_errors(Asset.open(folder / "asset"), Capture.open(folder / "capture"))
    assert f">{errors.psnr:.2f} dB<" in text and f">{errors.worst:.2f} dB<" in text and "100 random mixes" in text
    assert all(f"<td>{name.replace('&', '&amp;')}</td>" in text for name in NAMES)
    for words in ("worst mix", "middle mix", "best mix", "error ×8"):
        assert words in text
    assert page.count('alt="truth') == page.count('alt="error') == 3
    for words in ("By direction", "ABRDF", "By place", "In motion"):
        assert words not in text


@pytest.mark.slow
def test_maps_have_a_report_too(folder: Path, tmp_path: Path) -> None:
    capture = Capture.open(folder / "capture")
    asset = NamedMaps().encode(capture)
    page = write_report(asset, capture, tmp_path, evaluation=evaluate(asset, capture))
    assert "a map per light" not in page.read_text() and "8 lights" in page.read_text()
    assert "worst mix" in (tmp_path / "index.html").read_text() and "Random mixes" in (tmp_path / "report.md").read_text()


def test_lights_are_ordered_by_psnr_and_have_names(folder: Path) -> None:
    capture, asset = Capture.open(folder / "capture"), Asset.open(folder / "asset")
    subject = gather(asset, capture, evaluate(asset, capture), None)
    order = subject.worst_first(capture.indices("train"))
    errors = [subject.psnr_of(i) for i in order]
    assert errors == sorted(errors) and subject.light_words(order[0])[0] in NAMES and not subject.by_relative


def test_evaluate_tells_of_mixes(folder: Path) -> None:
    found = json.loads(ok("evaluate", folder / "asset", folder / "capture", "--json"))
    expected = mix_errors(Asset.open(folder / "asset"), Capture.open(folder / "capture"))
    assert found["mixes"]["count"] == 100 and found["mixes"]["psnr"] == expected.psnr and found["mixes"]["worst"] == expected.worst
    assert set(found["train"]) == {"rmse", "relative_rmse", "psnr", "psnr_pooled", "peak"}
    text = ok("evaluate", folder / "asset", folder / "capture")
    assert f"100 random mixes: PSNR {expected.psnr:.2f} dB" in text and len(text.splitlines()) == 3


def test_info_lists_the_names(folder: Path) -> None:
    for path, own in ((folder / "capture", "names"), (folder / "asset", "names")):
        assert json.loads(ok("info", path, "--json"))[own] == list(NAMES)
        line = next(line for line in ok("info", path).splitlines() if line.startswith("names"))
        assert all(name in line for name in NAMES)
    facts = json.loads(ok("info", folder / "asset", "--json"))
    assert facts["bytes_per_texel"] == {"named": 5} and facts["light_domain"] == "named" and "domain" not in facts
    assert json.loads(ok("info", folder / "capture", "--json"))["light_kinds"] == {"named": 8}


def test_many_names_are_cut_short(tmp_path: Path) -> None:
    names = tuple(f"Light {i}" for i in range(12))
    capture_of_names(tmp_path / "capture", names=names)
    line = next(line for line in ok("info", tmp_path / "capture").splitlines() if line.startswith("names"))
    assert "Light 7 and 4 more" in line and "Light 8" not in line
