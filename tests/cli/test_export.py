"""`srbf export` as a user has it."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from srbf.asset import Asset
from srbf.cli import app


def srbf(*arguments: object) -> Result:
    return CliRunner().invoke(app, list(map(str, arguments)))


@pytest.fixture
def asset(make_capture, plane_positions, tmp_path: Path) -> Path:
    y, x = np.mgrid[:10, :14] / 8
    bumps = np.stack([1 + 0.3 * np.sin(3 * x), 0.6 + 0.2 * np.cos(2 * y + x), 0.4 + 0.1 * y], axis=2)
    capture = make_capture(lambda d: np.maximum(0, d[2] + d[0] * 0.3 * np.sin(x)[..., None]) * bumps, position=plane_positions)
    done = srbf("fit", capture.folder, "-o", tmp_path / "asset", "-k", 9, "--spread", "mean", "--ridge", 0)
    assert done.exit_code == 0, done.stderr
    return tmp_path / "asset"


@pytest.mark.lengthy
def test_it_says_what_is_lost_and_what_it_costs(asset: Path, tmp_path: Path) -> None:
    done = srbf("export", asset, "-o", tmp_path / "out", "--target", "dds")
    assert done.exit_code == 0 and done.stdout == "", done.stderr
    exported = Asset.open(tmp_path / "out")
    psnr = exported.manifest["source"]["export"]["psnr"]
    assert f"relit PSNR {psnr:.2f} dB" in done.stderr and "9 layers of bc7, 4 levels" in done.stderr
    assert "GPU: 9 bytes per texel, " in done.stderr and "multiples of 4" in done.stderr
    facts = json.loads(srbf("info", tmp_path / "out", "--json").stdout)
    assert facts["encoding"] == "bc7" and facts["levels"] == 4 and facts["bytes_per_texel"]["spot"] == 9
    relit = srbf("relight", tmp_path / "out", "-o", tmp_path / "x.exr", "--directional", "0,0.3,1", "--point", "0,0,1")
    assert relit.exit_code == 0, relit.stderr


def test_json_alone_on_stdout(asset: Path, tmp_path: Path) -> None:
    done = srbf("export", asset, "-o", tmp_path / "out", "--target", "ktx2", "--encoding", "bc1", "--mip-levels", 2, "--json")
    told = json.loads(done.stdout)
    assert told["target"] == "ktx2" and told["encoding"] == "bc1" and told["levels"] == 2 and told["bytes_per_texel"] == 4.5
    assert told["layer_bytes"] == Asset.open(tmp_path / "out").layer_bytes() and told["psnr"] > 0


@pytest.mark.lengthy
def test_fewer_maps_first(asset: Path, tmp_path: Path) -> None:
    done = srbf("export", asset, "-o", tmp_path / "out", "--target", "png", "--reduce-to", 5)
    assert done.exit_code == 0 and "kept 5 of 9" in done.stderr
    assert Asset.open(tmp_path / "out").k == 5
    assert srbf("export", asset, "-o", tmp_path / "kept", "--reduce-to", 5).exit_code == 0
    bc7 = tmp_path / "bc7"
    assert srbf("export", asset, "-o", bc7, "--target", "dds").exit_code == 0
    assert srbf("export", bc7, "-o", tmp_path / "again", "--reduce-to", 4).exit_code == 0
    assert Asset.open(tmp_path / "again").encoding == "uint8"  # what blocks decode to


@pytest.mark.parametrize(
    ("flags", "code", "words"),
    [
        ([], 2, "--target or --reduce-to"),
        (["--reduce-to", 4, "--json"], 2, "--target with"),
        (["--target", "gif"], 2, "expected a target of exr, png, dds, ktx2, gltf"),
        (["--reduce-to", 4, "--encoding", "bc7"], 2, "--target dds or ktx2"),
        (["--reduce-to", 0], 2, "--reduce-to: expected a whole number of 1 or more, found '0'"),
        (["--target", "dds", "--mip-levels", "many"], 2, "--mip-levels: expected auto or a whole number"),
        (["--target", "dds", "--mip-levels", 9], 1, "0 to 4 mip levels of 14x10 texels, found --mip-levels 9"),
        (["--reduce-to", 12], 1, "--reduce-to of 1 to 9"),
        (["--target", "png", "--min-psnr", 190], 1, "expected at least 190 dB"),
        (["--target", "exr", "--encoding", "bc7"], 1, "half or float"),
    ],
)
def test_bad_input(asset: Path, tmp_path: Path, flags: list, code: int, words: str) -> None:
    done = srbf("export", asset, "-o", tmp_path / "out", *flags)
    assert done.exit_code == code and words in done.stderr and done.stdout == "", done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_without_etcpak_the_extra_is_named(asset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from srbf.io.containers import blocks

    blocks._etcpak.cache_clear()
    monkeypatch.setitem(sys.modules, "etcpak", None)
    done = srbf("export", asset, "-o", tmp_path / "out", "--target", "dds")
    assert done.exit_code == 1 and "srbf[export]" in done.stderr and not (tmp_path / "out").exists()
    assert srbf("export", asset, "-o", tmp_path / "out", "--target", "dds", "--encoding", "half").exit_code == 0
