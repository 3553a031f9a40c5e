"""Live scenes of `make site`: pages of demos, small enough for phones, and their list."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from web_assets import complete

from scripts import live_pages
from srbf.asset import Asset


def test_demos_become_pages_and_a_list(
    built: Path, make_asset: Callable[..., Asset], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    complete(make_asset(k=3)).save(tmp_path / "demos" / "house" / "asset")
    monkeypatch.setattr(sys, "argv", ["live_pages", "house", "--demos", str(tmp_path / "demos"), "-o", str(tmp_path / "made")])
    assert live_pages.main() == 0
    page = tmp_path / "made" / "live" / "house.html"
    size = page.stat().st_size
    assert f"- [House](live/house.html), {size / (1 << 20):.1f} MiB. " in (tmp_path / "made" / "live.md").read_text()
    assert "<html" in page.read_text()[:200]
    monkeypatch.setattr(live_pages, "LARGEST", size - 1)
    assert live_pages.main() == 1
    assert capsys.readouterr().err.startswith("expected pages of at most")
