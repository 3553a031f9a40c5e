"""The demo of all scenes: the index grows, one scene's failure leaves the others, what is finished is kept; and the CLI that runs it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
from typer.testing import CliRunner

from srbf import demo
from srbf.asset import Asset
from srbf.bake.run import Reporter
from srbf.cli import app
from srbf.demo import Demo, Progress, Quality, Shown, Steps, dome, finished, tour
from srbf.demo.dome import DOMES, Photographs
from srbf.demo.index_page import Card, address, data_uri, index_page
from srbf.demo.photographs import Dome
from srbf.errors import BakeError
from srbf.report import abrdf_mosaic, canvas

PICTURE = np.full((6, 8, 3), 90, np.uint8)


class Made:
    """Scenes that are made in no time: `failing` ones fail, early or once they were shown; `begun` and `seen` are the index then."""

    def __init__(self, failing: dict[str, str]) -> None:
        self.failing = failing
        self.made: list[str] = []
        self.begun: list[str] = []
        self.seen: list[str] = []

    def __call__(self, name: str, folder: Path, reporter: Reporter, progress: Progress, quality: Quality) -> Steps:
        folder.mkdir(exist_ok=True)
        self.made.append(name)
        self.begun.append((folder.parent / tour.INDEX).read_text())
        if self.failing.get(name) == "early":
            raise BakeError("expected a scene,\nfound none")
        yield Shown(folder / "asset", None, lambda: PICTURE)
        self.seen.append((folder.parent / tour.INDEX).read_text())
        if self.failing.get(name) == "late":
            raise RuntimeError("no Cycles")
        return Demo(folder / "report", (folder / "asset",), folder, None, error=f"errors of {name}")


@pytest.fixture
def scenes(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Made]:
    def put(**failing: str) -> Made:
        made = Made(failing)
        monkeypatch.setattr(tour, "STOPS", tuple(replace(stop, steps=made) for stop in tour.STOPS))
        for name, fake in (("page_files", dict), ("contents_of", lambda *_: {}), ("single_file", lambda _: "<html>")):
            monkeypatch.setattr(tour, name, fake)
        monkeypatch.setattr(tour, "scene_script", Path)
        return made

    return put


def links(index: str) -> list[str]:
    return [unquote(link).partition("#")[0] for link in re.findall(r'href="([^"]+\.html[^"]*)"', index)]


def test_all_scenes_can_be_opened_before_one_is_measured(scenes: Callable[..., Made], tmp_path: Path) -> None:
    made, said = scenes(), list[str]()
    assert tour.run_tour(tmp_path, Reporter(say=said.append), lambda *_: None) == []
    assert made.made == ["loft", "caustics", "coin"]
    assert [links(index) for index in made.begun] == [[], ["loft.html"], ["loft.html", "caustics.html"]]
    assert "Being made now." in made.begun[0] and made.begun[0].count("Not begun yet.") == 2
    assert [links(index) for index in made.seen] == [["loft.html", "caustics.html", "coin.html"]] * 3
    assert "Its errors are being measured." in made.seen[0] and "Errors of loft." in made.seen[1]
    assert made.seen[0].count("Its errors are measured once all scenes can be opened.") == 2
    assert all('http-equiv="refresh"' in index for index in made.seen)
    assert [line for line in said if line.startswith("open ")] == [
        f"open {tmp_path / 'index.html'}: one scene can be relit now, the others follow on the same page"
    ]
    last = (tmp_path / "index.html").read_text()
    assert 'http-equiv="refresh"' not in last and last.count("data:image/webp") == 3
    assert "Errors of coin." in last and all((tmp_path / page).read_text() == "<html>" for page in links(last))


def test_what_fails_leaves_the_other_scenes(scenes: Callable[..., Made], tmp_path: Path) -> None:
    made = scenes(loft="late", caustics="early")
    done = CliRunner().invoke(app, ["demo", "-o", str(tmp_path)])
    assert done.exit_code == 1 and "Traceback" not in done.output
    assert made.made == ["loft", "caustics", "coin"]
    index = (tmp_path / "index.html").read_text()
    assert links(index) == ["loft.html", "coin.html"], "a scene whose errors are missing can still be relit"
    assert "caustics failed: expected a scene, found none" in index
    assert "loft failed: RuntimeError no Cycles; caustics failed: expected a scene, found none;" in done.output
    again = scenes()
    done = CliRunner().invoke(app, ["demo", "-o", str(tmp_path)])
    assert done.exit_code == 0 and done.output.splitlines()[-1] == f"srbf: open {tmp_path / 'index.html'}"
    assert again.made == ["loft", "caustics"], "what was finished is kept"
    assert links((tmp_path / "index.html").read_text()) == ["loft.html", "caustics.html", "coin.html"]
    (tmp_path / "loft.html").unlink()
    (tmp_path / "coin" / tour.KEPT).write_text("{}")
    assert tour.run_tour(tmp_path, Reporter(), lambda *_: None, "draft") == []
    assert again.made[2:] == ["loft", "coin"], "its page is gone, or its record is damaged"
    before = (tmp_path / "index.html").read_text()
    done = CliRunner().invoke(app, ["demo", "-o", str(tmp_path), "--quality", "publish"])
    assert done.exit_code == 1 and "expected quality draft, that of the scenes in" in " ".join(done.output.split())
    assert again.made[4:] == [] and (tmp_path / "index.html").read_text() == before


def test_an_interrupted_tour_says_so(scenes: Callable[..., Made], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object) -> Steps:
        raise KeyboardInterrupt

    scenes()
    stops = (tour.STOPS[0], replace(tour.STOPS[1], steps=interrupt), tour.STOPS[2])
    monkeypatch.setattr(tour, "STOPS", stops)
    with pytest.raises(KeyboardInterrupt):
        tour.run_tour(tmp_path, Reporter(), lambda *_: None)
    index = (tmp_path / "index.html").read_text()
    assert 'http-equiv="refresh"' not in index and links(index) == ["loft.html"]
    assert index.count("Not finished: the same command resumes it.") == 3 and "Being made now." not in index
    done = CliRunner().invoke(app, ["demo", "-o", str(tmp_path), "--quality", "publish"])
    assert done.exit_code == 1 and "expected quality draft, that of the scenes in" in " ".join(done.output.split())
    assert (tmp_path / "index.html").read_text() == index, "what is there of another quality is not touched"
    again = scenes()
    assert tour.run_tour(tmp_path, Reporter(), lambda *_: None) == [] and again.made == ["loft", "caustics", "coin"]


def test_a_card_names_what_its_page_opens_with() -> None:
    opens = {"lights": [{"kind": "point", "color": "#ffe2bd", "on": True}], "tone": "agx"}
    link = address("loft.html", opens)
    page, _, state = link.partition("#")
    assert page == "loft.html" and '"' not in link and "#" not in state
    assert json.loads(unquote(state).replace("'", '"')) == opens
    text = index_page([Card("A & B", "Look.", opens), Card("C", "See.", opens, "c.html", data_uri(PICTURE))], grows=False)
    assert "A &amp; B" in text and text.count("no picture yet") == 1 and links(text) == ["c.html"]
    assert "http:" not in text and "https:" not in text, "it asks no host"


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (["--lights", "5"], "expected --lights with a scene under directional lights, found no --scene"),
        (
            ["--transport", "indirect", "--scene", "coin"],
            "expected --transport indirect with a scene under directional lights, found it with coin",
        ),
    ],
)
def test_flags_of_directional_lights(words: list[str], found: str, tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["demo", "-o", str(tmp_path / "out"), *words])
    assert done.exit_code == 2 and found in " ".join(done.output.split())
    assert not (tmp_path / "out").exists()


def test_a_split_bake_has_no_lights_to_choose_by() -> None:
    scene = demo.SCENES["caustics"]
    draft, fine = (scene.settings(144, quality, "indirect") for quality in ("draft", "publish"))
    assert draft.transport == "indirect" and draft.validation == 0 and draft.holdout > 0
    assert fine.sun_angle == 0, "shadow maps are sharp"


@pytest.mark.blender
def test_a_coin_from_photographs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(DOMES, "coin", {"draft": Photographs(Dome(9, 2, 12), 24, 1)})
    monkeypatch.setattr(dome, "PAGE_FIT", replace(demo.PAGE_FIT, clusters=2, components=4))
    for module in (canvas, abrdf_mosaic):
        monkeypatch.setattr(module, "DPI", 40)
    steps = dome.dome_steps("coin", tmp_path, Reporter(), lambda *_: None)
    shown = next(steps).picture()
    made = finished(steps)
    assert len(list((tmp_path / "photographs").glob("*.jpg"))) == 11
    assert shown.shape == (24, 24, 3) and shown.dtype == np.uint8 and shown.max() > 100
    assert 0 < Asset.open(made.assets[0]).manifest["error"]["holdout"]["relative_rmse"] < 1
    assert made.page.is_file()
    assert made.error.startswith("2 held-out photographs: relative RMSE ")


@pytest.mark.blender
def test_caustics_with_direct_light_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(demo, "SCENES", {"caustics": replace(demo.SCENES["caustics"], size=(24, 24))})
    monkeypatch.setattr(demo, "HOLDOUT_SAMPLES", 1)
    monkeypatch.setattr(demo, "PAGE_FIT", replace(demo.PAGE_FIT, clusters=2, components=4))
    monkeypatch.setattr(demo, "write_report", lambda *_args, **_named: tmp_path / "index.html")
    words = ["demo", "--scene", "caustics", "--transport", "indirect", "--lights", "26", "-o", str(tmp_path)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    asset = Asset.open(tmp_path / "asset")
    assert asset.transport == "indirect" and (tmp_path / "scene.glb").is_file()
    assert "direct light included, at 5 bytes per texel" in done.output
    assert demo.under_sun(asset, "ray").shape == (24, 24, 3)
