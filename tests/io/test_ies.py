"""IES files: header forms, symmetries, interpolation, and what is not read."""

from __future__ import annotations

import numpy as np
import pytest
from made_profiles import UNEVEN, ies_text

from srbf.errors import InputError
from srbf.io.ies import CANDELA, COLUMNS, ROWS, parse_ies

V, H = [0.0, 45.0, 90.0], [0.0, 45.0, 90.0]
CD = [[100.0, 80.0, 50.0], [60.0, 50.0, 20.0], [40.0, 10.0, 5.0]]
TEXT = ies_text(V, H, CD)


def parsed(text: str) -> object:
    return parse_ies(text.encode("latin-1"), "downlight.ies")


@pytest.mark.parametrize(
    "head",
    [
        "",
        "IESNA91\n[TEST] A\n[MANUFAC] B\n",
        "IESNA:LM-63-1995\n[TEST] A\n[MORE] Lümen 1 2 3\n",
        "IESNA:LM-63-2002\r\n[TEST] A\r\n[ISSUEDATE] 1\r\n",
        "IES:LM-63-2019\n[TEST] A\n",
    ],
    ids=["1986", "1991", "1995", "2002", "2019"],
)
def test_files_of_every_edition_are_read(head: str) -> None:
    found = parse_ies((head + TEXT[TEXT.index("TILT") :]).encode("latin-1"), "downlight.ies")
    np.testing.assert_array_equal(found.vertical, V)
    np.testing.assert_array_equal(found.horizontal, [0, 45, 90, 135, 180, 225, 270, 315, 360])
    np.testing.assert_array_equal(found.candela[[0, 1, 2, 3, 4, 5, 6, 7, 8]], np.array(CD)[[0, 1, 2, 1, 0, 1, 2, 1, 0]])


def test_numbers_may_break_anywhere_and_have_commas_and_factors_multiply() -> None:
    body = ies_text(V, H, CD, "0.5 1.5 100", 2)
    words = body[body.index("NONE") + 4 :].split()
    split = body[: body.index("NONE") + 4] + "\n" + ",\n".join(", ".join(words[i : i + 4]) for i in range(0, len(words), 4))
    np.testing.assert_allclose(parse_ies(split.encode(), "x").candela[0], np.array(CD[0]) * 2 * 0.5 * 1.5)


@pytest.mark.parametrize(
    ("horizontal", "rows"),
    [
        ([0], [0]),
        ([0, 90], [0, 1, 0, 1, 0]),
        ([0, 90, 180], [0, 1, 2, 1, 0]),
        ([0, 120, 240, 360], [0, 1, 2, 0]),
        ([0, 120, 240], [0, 1, 2, 0]),
    ],
    ids=["axial", "quarter", "half", "whole", "whole, without its end"],
)
def test_symmetries_fill_the_circle(horizontal: list[float], rows: list[int]) -> None:
    candela = [[100.0, 50.0], [80.0, 40.0], [60.0, 30.0], [100.0, 50.0]][: len(horizontal)]
    found = parse_ies(ies_text([0, 90], horizontal, candela).encode(), "x")
    np.testing.assert_array_equal(found.candela, np.array(candela)[rows])
    assert found.horizontal[-1] == (0 if len(horizontal) == 1 else 360)


def test_a_table_has_the_files_numbers_at_its_angles_and_none_outside() -> None:
    found = parse_ies(TEXT.encode(), "x")
    for as_cycles in (True, False):
        table = found.table(as_cycles)
        assert table.shape == (ROWS, COLUMNS)
        np.testing.assert_allclose(table[[0, 90, 180]][:, [0, 90, 180]], CANDELA * np.array(CD).T, rtol=1e-6)
        assert (table[181:] == 0).all() and (table >= 0).all()


def test_an_even_file_is_even_but_where_cycles_is_not() -> None:
    found = parse_ies(ies_text([0, 90, 180], [0], [[10, 10, 10]]).encode(), "x")
    np.testing.assert_allclose(found.table(as_cycles=False), 10 * CANDELA, rtol=1e-6)
    brighter = found.table() / (10 * CANDELA)
    assert brighter[0, 0] == pytest.approx(1) and brighter[0].max() == pytest.approx(1.125, abs=1e-3)  # half way around


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "a line TILT=NONE"),
        (TEXT.replace("TILT=NONE", "TILT=INCLUDE"), "TILT=INCLUDE"),
        (TEXT.replace("TILT=NONE", "TILT=a.tlt"), "a.tlt"),
        (TEXT.replace("1 2 0 0 0", "2 2 0 0 0"), "found type B"),
        (TEXT.replace("1 2 0 0 0", "3 2 0 0 0"), "found type A"),
        (TEXT[: len(TEXT) // 2 + 40], "cut off"),
        (TEXT.replace("80", "eighty"), "eighty"),
        (TEXT.replace("80", "-80"), "at least 0"),
        (TEXT.replace("80", "inf"), "finite"),
        (TEXT.replace("1 1000 1 3 3", "1 1000 1 3.5 3"), "numbers of vertical"),
        (TEXT.replace("1 1000 1 3 3", "1 1000 1 99999999 3"), "numbers of vertical"),
        (ies_text([0, 90, 45], H, CD), "ascending vertical"),
        (ies_text(V, [0, 90, 45], CD), "ascending horizontal"),
        (ies_text(V, [0, 20, 70], CD), "0, 90, 180 or 360"),
        (ies_text(V, [10, 20, 90], CD), "0, 90, 180 or 360"),
    ],
)
def test_what_is_not_read_says_so_in_one_line(text: str, line: str) -> None:
    with pytest.raises(InputError, match="downlight.ies") as error:
        parsed(text)
    assert line in str(error.value) and "\n" not in str(error.value)


def test_the_tests_own_file_is_read() -> None:
    assert parse_ies(UNEVEN.encode(), "x").candela.shape == (13, 6)
