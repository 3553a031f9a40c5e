"""Flags that cannot be parsed: wrong usage, exit 2, one line with what was expected and found."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import typer
from test_commands import misused

from srbf.cli.values import AUTO_OR_ANGLE, AUTO_OR_COUNT, POSITIVE, Number, Size, duration, parse_share, size


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--size", "abc"], "--size: expected N or WxH texels, found 'abc'"),
        (["--size", "4x"], "found '4x'"),
        (["--size", "0"], "found '0'"),
        (["--samples", "many"], "--samples: expected auto or a whole number of 1 or more, found 'many'"),
        (["--samples", "0"], "found '0'"),
        (["--lights", "1.5"], "--lights: expected auto or a whole number of 1 or more, found '1.5'"),
        (["--holdout", "-1"], "--holdout: expected a whole number of 0 or more"),
        (["--sun-angle", "wide"], "--sun-angle: expected auto or a number from 0 to 3.14159, found 'wide'"),
        (["--sun-angle", "nan"], "found 'nan'"),
        (["--time-limit", "soon"], "--time-limit: expected a duration as 90s, 30m or 8h, found 'soon'"),
        (["--texels-per-meter", "0"], "--texels-per-meter: expected a number above 0"),
        (["--domain", "moon"], "--domain: 'moon' is not one of 'sphere', 'hemisphere'"),
        (["--shard", "3/2"], "I from 1 to N, found '3/2'"),
        (["--light-set", "point:x"], "point:SPACING"),
        (["--light-set", "point:1", "--light-bounds", "0,1"], "--light-bounds x0,y0,z0,x1,y1,z1"),
        (["--light-bounds", "0,0,0,1,1,1"], "expected --light-set named, cloud, patches or surfels with --light-bounds"),
        (["--light-set", "point:1", "--sun-angle", "auto"], "--sun-angle auto"),
        (["--receiver", "mirror"], "expected a receiver"),
        (["--receiver", "view"], "found view"),
        (["--uv-layer", "UV"], "--uv-layer"),
        (["--denoise", "--time-limit", "3m"], "--denoise"),
        (["--shard", "1/2", "--samples", "auto"], "--shard needs to know"),
        (["--farm", "openjd", "--time-limit", "3m"], "--farm needs to know"),
        (["--shard", "1/2", "--dask", "tcp://a:1"], "one way to spread the work"),
        (["--shard", "1/2", "--force"], "--shard prepare"),
        (["--dask", "tcp://a:1", "--workers", "2"], "--workers"),
        (["--light-set", "cubemap:4", "--lights", "400"], "expected --light-set cubemap:4 without --lights, found both"),
        (["--light-set", "cubemap:4", "--samples", "5"], "expected --light-set cubemap:4 without --samples, found both"),
        (["--light-set", "cubemap:4", "--time-limit", "5m"], "expected --light-set cubemap:4 without --time-limit, found both"),
        (["--light-set", "cubemap:4", "--operator", "cycles"], "expected --light-set surfels with --operator cycles, found cubemap:4"),
        (["--light-set", "gather", "--operator", "cycles"], "expected --light-set surfels with --operator cycles, found gather"),
        (["--light-set", "gather", "--lights", "9"], "expected --light-set gather without --lights, found both"),
        (["--light-set", "gather", "--samples", "9"], "expected --light-set gather without --samples, found both"),
        (["--gather", "120"], "expected --light-set gather with --gather, found none"),
        (["--light-set", "surfels", "--gather", "120"], "expected --light-set gather with --gather, found surfels"),
        (["--light-set", "gather", "--gather", "7"], "expected 8 to 2000 samples of a cluster with --gather, found 7"),
        (["--light-set", "gather", "--gather", "2001"], "expected 8 to 2000 samples of a cluster with --gather, found 2001"),
        (["--light-set", "gather", "--gather", "120", "--pool", "500"], "expected --gather without --pool, found both"),
        (["--light-set", "surfels", "--lights", "9"], "expected --light-set surfels without --lights, found both"),
        (["--light-set", "surfels", "--samples", "9"], "expected --light-set surfels without --samples, found both"),
        (["--light-set", "surfels", "--operator", "cycles", "--lights", "9"], "expected --light-set surfels without --lights, found both"),
        (["--light-set", "named", "--domain", "sphere"], "expected --light-set named without --domain, found both"),
        (["--light-set", "point:1", "--domain", "sphere"], "expected --light-set point:1 without --domain, found both"),
        (["--light-set", "cubemap:4", "--full", "--sparse-by", "l1"], "expected --full or --sparse-by l1, found both; leave one"),
        (["--light-set", "cubemap:4", "--sparse", "--full"], "expected --full or --sparse, found both"),
        (["--sparse-by", "neighbors"], "expected --light-set cubemap:SIDE with --sparse-by, found none"),
    ],
)
def test_a_bakes_flags(tmp_path: Path, flags: list[str], words: str) -> None:
    assert words in misused("bake", tmp_path / "none.blend", "-o", tmp_path / "x", "--receiver", "view", *flags)
    assert not (tmp_path / "x").exists()


def test_a_bake_without_a_receiver(tmp_path: Path) -> None:
    assert "expected a --receiver or a --collection" in misused("bake", tmp_path / "none.blend", "-o", tmp_path / "x")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["fit", "a", "-o", "x", "--error", "5 percent"], "--error: expected a share above 0 and below 1, such as 5% or .05"),
        (["fit", "a", "-o", "x", "--error", "100%"], "found '100%'"),
        (["fit", "a", "-o", "x", "--error", "5%", "--psnr", "40"], "expected a --error or a --psnr"),
        (["fit", "a", "-o", "x", "--method", "eigen-map", "--error", "5%"], "--error applies only to method auto or transfer"),
        (["fit", "a", "-o", "x", "--visibility", "foo"], "expected --visibility none or pca:COUNT with 1 to 256 coefficients, as pca:50"),
        (["fit", "a", "-o", "x", "--visibility", "pca:0", "--budget", "13"], "found 'pca:0'"),
        (["fit", "a", "-o", "x", "--surfels", "9000", "--budget", "13"], "expected --surfels auto or 1 to 8000, found 9000"),
        (["relight", "a", "-o", "x.png", "--albedo", "Wall=2,2,2"], "expected --albedo OBJECT=R,G,B of 0 to 1, found 'Wall=2,2,2'"),
        (["relight", "a", "-o", "x.png", "--emissive", "Wall=-1,2,2"], "expected --emissive OBJECT=R,G,B of at least 0"),
        (["evaluate", "a", "b", "--samples", "0"], "--samples: expected a whole number of 1 or more"),
        (["evaluate", "a"], "found one path"),
        (["evaluate", "--leave-one-out", "a", "b"], "found a second path"),
        (["view", "a", "--port", "70000"], "--port: expected a whole number from 0 to 65535, found '70000'"),
        (["demo", "-o", "x", "--lights", "0"], "--lights: expected a whole number of 1 or more"),
        (["import", "--lp", "x", "-o", "y", "--transfer", "gamma"], "--transfer: 'gamma' is not one of"),
    ],
)
def test_flags_of_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: str) -> None:
    monkeypatch.chdir(tmp_path)
    assert words in misused(*arguments)


def test_numbers_in_their_range_or_words() -> None:
    assert AUTO_OR_COUNT("auto") == "auto" and AUTO_OR_COUNT("7") == 7 and AUTO_OR_COUNT(7) == 7
    assert AUTO_OR_ANGLE("0") == 0 and AUTO_OR_ANGLE(str(math.pi)) == math.pi
    assert POSITIVE("1e-9") == 1e-9 and Number()("-inf") == -math.inf
    for number, text in ((POSITIVE, "0"), (POSITIVE, "nan"), (Number(high=2), "2.1"), (AUTO_OR_COUNT, "auto "), (AUTO_OR_COUNT, "")):
        with pytest.raises(typer.BadParameter, match="expected .* found"):
            number(text)
    assert str(Number(high=2, words=("auto", "mean"))) == "auto, mean or a number of at most 2"


def test_sizes_and_durations() -> None:
    assert size("256") == Size(256, 256) and size("640X480") == (640, 480) == size(Size(640, 480))
    assert duration("1h30m") == 5400 and duration("90") == duration("90s") == duration("1.5m") == 90


def test_a_share_as_percent_or_as_a_number() -> None:
    assert parse_share("5%") == pytest.approx(0.05) == parse_share(".05") == parse_share(" 5 %")
