"""docs/gallery.md has the captions that the gallery's script writes, and the script's checksums cover modules that exist."""

from __future__ import annotations

from pathlib import Path

import pytest

from scripts.gallery.captions import CAPTIONS, INTRODUCTION, TITLES

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
SHOWN = [name for name in TITLES if (ROOT / "docs" / "gallery" / f"{name}-strip.webp").is_file()]


def test_the_page_begins_with_the_introduction() -> None:
    assert PAGE.startswith(INTRODUCTION.format(folder="gallery", figure="error-by-bytes.webp"))


@pytest.mark.parametrize("name", SHOWN)
def test_the_page_has_the_caption_of_each_scene(name: str) -> None:
    assert f"## {TITLES[name]}\n\n{CAPTIONS[name].strip()}\n" in PAGE


def test_the_checksums_of_the_steps_cover_modules_that_exist() -> None:
    pytest.importorskip("matplotlib")
    from scripts.gallery.making import COMPARING, FITTING, MEASURING, library

    assert len({library(patterns) for patterns in (FITTING, MEASURING, COMPARING)}) == 3
    with pytest.raises(ValueError, match="no_such_module"):
        library((*FITTING, "no_such_module"))
