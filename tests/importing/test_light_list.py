"""Light lists as people write them: encodings, quotes, comments, and faults said with their remedy."""

from __future__ import annotations

import codecs
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from srbf.errors import ManifestError
from srbf.importing.light_list import LightListEntry, below_the_horizon, read_light_list

NAME = "Façade é.png"
TEXT = f"2\n{NAME} 0 0 2\nb.png 0.6 0 0.8\n"


def entries_of(folder: Path, text: str, **more: str) -> list[LightListEntry]:
    (folder / "l.lp").write_text(text, encoding="utf-8", newline="")
    return read_light_list(folder / "l.lp", **more)


@pytest.mark.parametrize(
    ("data", "encoding"),
    [
        (TEXT.encode(), None),
        (codecs.BOM_UTF8 + TEXT.encode(), None),
        (TEXT.encode("utf-16"), "UTF-16"),
        (codecs.BOM_UTF16_BE + TEXT.encode("utf-16-be"), "UTF-16"),
        (TEXT.encode("utf-16-le"), "UTF-16"),
        (TEXT.encode("utf-16-be"), "UTF-16"),
        (TEXT.encode("utf-32"), "UTF-32"),
        (TEXT.encode("latin-1"), "Latin-1"),
        (TEXT.replace("2\n", "2\r\n").encode("latin-1"), "Latin-1"),
    ],
)
def test_encodings_are_found_and_said(tmp_path: Path, data: bytes, encoding: str | None) -> None:
    (tmp_path / "l.lp").write_bytes(data)
    said: list[str] = []
    entries = read_light_list(tmp_path / "l.lp", say=said.append)
    assert [entry.name for entry in entries] == [NAME, "b.png"] and entries[1].place == pytest.approx((0.6, 0, 0.8))
    assert said == ([] if encoding is None else [f"read l.lp as {encoding}"])


def test_windows_punctuation_is_not_latin_1(tmp_path: Path) -> None:
    (tmp_path / "l.lp").write_bytes("1\nvue – 1.png 0 0 1\n".encode("cp1252"))
    said: list[str] = []
    assert read_light_list(tmp_path / "l.lp", say=said.append)[0].name == "vue – 1.png" and said == ["read l.lp as Windows-1252"]


@pytest.mark.parametrize("data", [b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", b"1\na\x01.png 0 0 1\n", b"\xff\xfe\x00", b"1\n\x81 0 0 1\n"])
def test_what_is_not_text_is_refused(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "l.lp").write_bytes(data)
    with pytest.raises(ManifestError, match="it is not text"):
        read_light_list(tmp_path / "l.lp")


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ('"a b.png" 0 0 1', "a b.png"),
        ("'a b.png'\t0 0 1", "a b.png"),
        ("“a b.png” 0 0 1", "a b.png"),
        ("a  b.png   0\t0  1", "a  b.png"),
        ('"#1.png" 0 0 1', "#1.png"),
        ("a.png 0 0 1 # zenith", "a.png"),
        ("a.png 0 0 1 // zenith", "a.png"),
        ("a #2.png 0 0 1", "a #2.png"),
        ("IMG 5 0 0 1", "IMG 5"),
        ('"a.png 5" 0 0 1', "a.png 5"),
        ("a.png 0 0 1e0", "a.png"),
        ("O'Brien's.png +0 -0 .5", "O'Brien's.png"),
        ("../jpeg-exports/a.jpg 0 \u22120 1", "../jpeg-exports/a.jpg"),
    ],
)
def test_names_as_people_write_them(tmp_path: Path, line: str, name: str) -> None:
    assert entries_of(tmp_path, f"1\n{line}\n") == [LightListEntry(name, (0, 0, 1))]


def test_comments_and_blank_lines_are_skipped_and_lines_keep_their_number(tmp_path: Path) -> None:
    text = "# dome 3\r\n\r\n2 # lights\r\n; first ring\r\na.png 0 0 1\r\n   \r\n// second\r\nb.png 1 0 0\r\n\r\n"
    assert [entry.name for entry in entries_of(tmp_path, text)] == ["a.png", "b.png"]
    with pytest.raises(ManifestError, match="line 8 of .*l.lp, found 'b.png 1 0'"):
        entries_of(tmp_path, text.replace("1 0 0", "1 0"))
    with pytest.raises(ManifestError, match="expected 3 lights .* found 2, 3 comment lines aside"):
        entries_of(tmp_path, text.replace("2 # lights", "3"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a.png 0 0 1\nb.png 0 1 1\n", "number of lights on the first line.*put 2 above them"),
        ("1\na.png 0,5 0,5 0,7\n", "line 2.*decimal comma: write 0.5"),
        ("1\na.png;0,5;0,5;0,7\n", "line 2.*decimal comma: write 0.5"),
        ("1\na.png,0,0,1\n", "line 2.*write spaces"),
        ("1\na.png, 0.5, 0.5, 0.7\n", "line 2.*write spaces"),
        ("1\na.png;0;0.2;1\n", "line 2.*write spaces"),
        ("1\na.png 45 30\n", r"line 2.*azimuth and elevation.*x = cos\(elevation\) cos\(azimuth\).*z = sin\(elevation\)"),
        ("1\na.png 45° 30°\n", r"line 2.*degrees are not read.*x = cos\(elevation\)"),
        ("1\na.png 45deg 30deg\n", "line 2.*degrees are not read"),
        ("3\na.png 10 30 1\nb.png 120 45 1\nc.png 300 -10 1\n", "azimuth and elevation in degrees.*z = sin"),
        ("2\na.png 0 0 1\nb.png 0 0 1 0.5\n", "line 3.*4 numbers follow the name.*remove the rest"),
        ("2\na.png 0 0 1 1\nb.png 0 1 1 1\n", "line 2.*4 numbers follow the name"),
        ('1\n"a b.png" 0 0 1 1\n', "line 2.*4 numbers"),
        ("1\na.png 0 0 1e999\n", "line 2"),
        ("1\na.png 0 0 1_0\n", "line 2"),
        ("1\n0 0 1\n", "line 2"),
        ("9" * 5000 + "\na.png 0 0 1\n", "number of lights"),
        ("0\n", "expected 0 lights"),
    ],
)
def test_faults_name_their_line_and_remedy(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(ManifestError, match=words) as caught:
        entries_of(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_positions_and_rings_are_not_taken_for_degrees(tmp_path: Path) -> None:
    azimuth = np.radians(np.arange(0, 360, 45))
    ring = "8\n" + "".join(f"{i}.png {50 * np.cos(a):.6f} {50 * np.sin(a):.6f} 0\n" for i, a in enumerate(azimuth))
    assert entries_of(tmp_path, ring)[2].place == pytest.approx((0, 1, 0), abs=1e-6)
    panel = "3\na.png 10 30 1\nb.png 120 45 1\nc.png 300 -10 1\n"
    assert entries_of(tmp_path, panel, kind="point")[0].place == (10, 30, 1)
    assert len(entries_of(tmp_path, panel.replace(" 1\n", " 80\n"))) == 3


def test_lights_below_are_counted() -> None:
    up, flat, down = (LightListEntry(name, (0.6, 0.0, z)) for name, z in (("u", 0.8), ("f", 0.0), ("d", -0.8)))
    assert below_the_horizon([up, up], "l.lp") is None
    assert "2 of 3 lights of l.lp are below the surface" in str(below_the_horizon([up, flat, down], "l.lp"))
    assert "all 2 lights of l.lp are below the horizon" in str(below_the_horizon([flat, down], "l.lp"))


WORDS = st.sampled_from(
    ["a.png", "0", "1", "-0.5", "0,5", "°", '"', "'", "#", "//", ";", "nan", "1e999", "\t", " ", "\n", "\r\n", "2", "é"]
)


@pytest.mark.slow
@given(
    data=st.one_of(
        st.binary(max_size=80), st.text(max_size=60).map(str.encode), st.lists(WORDS, max_size=30).map(lambda w: " ".join(w).encode())
    )
)
@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_are_entries_or_one_error(tmp_path: Path, data: bytes) -> None:
    for prefix in (b"", b"1\n", b"\xff\xfe"):
        (tmp_path / "l.lp").write_bytes(prefix + data)
        try:
            entries = read_light_list(tmp_path / "l.lp")
        except ManifestError as error:
            assert "l.lp" in str(error)
        else:
            assert entries and np.allclose(np.linalg.norm([entry.place for entry in entries], axis=1), 1)
