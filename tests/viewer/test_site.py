"""`srbf export --target web`: a folder that any static host serves, and an asset."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from view_assets import seen_room
from web_assets import complete, on_a_plane

from srbf.asset import Asset
from srbf.export import Settings, export
from srbf.lights import DirectionalLight
from srbf.methods import relight

SUN = [DirectionalLight((0.3, -0.4, 0.8))]


@pytest.fixture
def lightmap(make_asset: Callable[..., Asset]) -> Asset:
    made = make_asset(k=4, height=12, width=16, encoding="half")
    return complete(on_a_plane(made), source={"receiver": {"kind": "lightmap", "object": "Table"}})


@pytest.mark.parametrize("encoding", ["half", "float", "uint8", "bc7"])
def test_a_site_is_the_asset_and_the_page(built: Path, lightmap: Asset, tmp_path: Path, encoding: str) -> None:
    site = tmp_path / "site"
    report = export(lightmap, "web", site, Settings(encoding=encoding))  # type: ignore[arg-type]
    opened = Asset.open(site)
    assert (opened.encoding, report.encoding) == (encoding, encoding)
    if encoding in ("half", "float"):
        assert np.allclose(relight(opened, SUN), relight(lightmap, SUN))
    assert (site / "viewer.js").read_bytes() == (built / "viewer.js").read_bytes()
    assert (site / "mesh.glb").read_bytes()[:4] == b"glTF"
    told = json.loads((site / "viewer.json").read_text())
    assert (told["mesh"], told["kind"], told["title"], told["capture"]) == ("mesh.glb", "lightmap", "Table", None)
    assert [one["folder"] for one in told["assets"]] == ["./"]
    named = {"asset.json", "mesh.glb", "viewer.json", "spectrum.json", "index.html", "viewer.js", "viewer.css", "LICENSES.txt"}
    assert {path.name for path in site.iterdir() if path.is_file()} == named
    assert str(tmp_path) not in (site / "viewer.json").read_text()


def test_a_view_comes_with_its_camera(built: Path, make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    export(seen_room(make_asset(k=3, height=18, width=28)), "web", tmp_path / "site")
    told = json.loads((tmp_path / "site" / "viewer.json").read_text())
    assert (told["kind"], told["mesh"]) == ("view", None)
    assert np.allclose(told["camera"]["position"], [0.3, -4.0, 1.2], atol=1e-2)


def test_a_page_asks_no_other_machine(built: Path) -> None:
    """What the browser fetches is named in the page, and none of it is elsewhere."""
    page = (built / "index.html").read_text() + (built / "viewer.css").read_text()
    assert "//" not in page.replace("https://www.w3.org", "")
    assert 'src="./viewer.js"' in page
    assert 'href="./viewer.css"' in page


def test_the_terms_of_what_is_bundled_come_with_it(built: Path) -> None:
    text = (built / "LICENSES.txt").read_text()
    for package in ("three", "fast-png", "parse-exr", "ktx-parse"):
        assert f"\n{package} " in text, package
    assert "George Michael Brower" in text, "the panel's, which three holds"
    assert text.count("Permission is hereby granted") >= 4


def test_a_lightmap_without_positions_is_shown_as_texels(built: Path, make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    asset = complete(make_asset(k=3, position=False), source={"receiver": {"kind": "lightmap", "object": "Table"}})
    report = export(asset, "web", tmp_path / "site")
    told = json.loads((tmp_path / "site" / "viewer.json").read_text())
    assert told["mesh"] is None
    assert any("no mesh: expected a position map" in note for note in report.notes)
