"""scripts/check_words.py finds a planted word, and only that."""

from __future__ import annotations

from pathlib import Path

import pytest

from scripts.check_words import NOT_YET, ROOT, findings, scanned


def words_of(text: str) -> list[tuple[int, str]]:
    return [(found.line, found.word) for found in findings("page.md", text)]


def test_it_finds_a_planted_word_with_its_line() -> None:
    assert words_of("A point light.\nA lamp in the room.\n") == [(2, "lamp")]


@pytest.mark.parametrize(
    "text",
    [
        "lamp_table",
        "tableOfLamps",
        "SrbfLamp",
        "KEEP_LAMPS",
        "13 bytes a texel",
        "two fetches a map",
        "the Colour",
        "foretells",
        "goes on with",
    ],
)
def test_it_finds_words_in_identifiers_and_phrases(text: str) -> None:
    assert len(words_of(text)) == 1


@pytest.mark.parametrize(
    "text",
    [
        "clamped, clamp(), Clamps, CLAMP",
        "No Cholesky: the Gram matrix is indefinite",
        "var material: PanoramaSkyMaterial = sky.sky  # words: ok",
        'extras["tint_by_cosine"]',
        '"Desk lamp"',
        "percentage",
        "13 bytes per texel, a map, once per frame",
    ],
)
def test_it_passes_the_fields_words_names_of_others_and_marked_lines(text: str) -> None:
    assert words_of(text) == []


def test_every_exception_is_a_path_of_the_project() -> None:
    assert [name for name in NOT_YET if not (ROOT / name).exists()] == []


def test_the_scan_covers_pages_and_code_and_leaves_out_the_record_of_changes() -> None:
    names = {path.relative_to(ROOT).as_posix() for path in scanned()}
    assert {"README.md", "DESIGN.md", "Makefile", "srbf/report/page.py", "srbf/sphere.py"} <= names
    assert "CHANGELOG.md" not in names


def test_a_named_path_is_scanned_even_where_it_is_an_exception(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scripts.check_words.NOT_YET", ("README.md",))
    assert Path(ROOT / "README.md") in scanned(["README.md"])
    assert Path(ROOT / "README.md") not in scanned()
