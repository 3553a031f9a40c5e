"""The index of the demo in a browser: it opens from disk, and its links open pages in the state that they name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from web_assets import complete

from srbf.asset import Asset
from srbf.demo.index_page import data_uri, index_page
from srbf.demo.tour import STOPS
from srbf.viewer.contents import contents_of
from srbf.viewer.single_file import single_file


def test_a_link_opens_its_page_from_disk(built: Path, chromium: Any, make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    complete(make_asset(k=3)).save(tmp_path / "asset")
    (tmp_path / "coin.html").write_text(single_file(contents_of([tmp_path / "asset"])))
    cards = [stop.card() for stop in STOPS]
    coin = cards[-1]
    coin.page, coin.picture = "coin.html", data_uri(np.full((6, 8, 3), 90, np.uint8))
    (tmp_path / "index.html").write_text(index_page(cards, grows=True))
    chromium("open", url=(tmp_path / "index.html").as_uri(), moving=True)
    assert chromium("run", script="document.querySelectorAll('article').length") == 3
    assert chromium("run", script="document.querySelector('img').naturalWidth") == 8, "its policy lets the picture be shown"
    link = chromium("run", script="document.querySelector('a').href")
    chromium("open", url=link)
    (light,) = chromium.state()["lights"]
    assert light["direction"] == coin.opens["lights"][0]["direction"]
