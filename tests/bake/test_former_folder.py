"""Bakes that an earlier version left unfinished are resumed, to the bits of an undisturbed bake."""

from __future__ import annotations

import shlex
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from faults import HERE, contents

from srbf.bake.folder import hold
from srbf.bake.former_folder import FILES, FORMER, adopt
from srbf.bake.images import CaptureImages, checksum_of
from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings, Receiver
from srbf.bake.shard import Shard
from srbf.io import files

SETTINGS = BakeSettings(Receiver("lightmap", "Plane"), 8, 8, lights=5, samples=4, validation=1, holdout=1, holdout_samples=8)


@pytest.fixture
def bake(tmp_path: Path) -> Bake:
    blender = tmp_path / "blender"
    blender.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {shlex.quote(str(HERE / "fake_blender.py"))} "$@"\n')
    blender.chmod(0o755)
    scene = tmp_path / "scene.blend"
    scene.write_bytes(b"BLENDER that only the fake one reads")
    return Bake(scene, tmp_path / "capture", replace(SETTINGS, transport="indirect"), blender, keep_accumulation=True)


def as_before(folder: Path) -> None:
    """Give the folder of a bake the names that an earlier version wrote."""
    stored = files.read_json(folder / "accumulation" / "prepared.json")["prepared"]
    former = {present: f"{FORMER}/{name}" for name, present in FILES.items()}
    prepared = {
        "facts": stored["facts"],
        "sampling": stored["sampling"],
        "tints": stored["transmittances"],  # words: ok
        "ambient": "ambient" in stored["channels"],
        "seams": stored["seams"],
        "uv": stored["uv"],
        "files": {former.get(name.removeprefix("accumulation/"), name): checksum for name, checksum in stored["files"].items()},
    }
    files.write_json(folder / "accumulation" / "prepared.json", {"sha256": checksum_of(prepared), "prepared": prepared})
    for name, present in FILES.items():
        (folder / "accumulation" / present).replace(folder / "accumulation" / name)
    (folder / "accumulation").replace(folder / FORMER)


@pytest.mark.lengthy
def test_a_former_bake_is_resumed_without_preparing_it_again(bake: Bake, tmp_path: Path) -> None:
    whole = replace(bake, folder=tmp_path / "whole")
    assert whole.run(Reporter())
    assert replace(bake, settings=replace(bake.settings, samples=2)).run(Reporter())
    before = (bake.folder / "position.exr").stat().st_mtime_ns
    as_before(bake.folder)
    said: list[str] = []
    assert bake.run(Reporter(say=said.append))
    assert any("7 of 7 lights are done" in line for line in said), said
    assert (bake.folder / "position.exr").stat().st_mtime_ns == before
    assert contents(bake.folder) == contents(whole.folder)


@pytest.mark.parametrize("steps", [0, 1, 2, 3, 4])
def test_adopting_a_folder_may_be_killed_at_any_step(bake: Bake, steps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each rename and the record in turn is the last that happens; the next process completes the rest."""
    assert bake.run(Reporter())
    expected = contents(bake.folder)
    as_before(bake.folder)
    left = steps

    def step(name: str):
        real = getattr(Path, name)

        def once(self: Path, *arguments: object) -> object:
            nonlocal left
            if left == 0:
                raise KeyboardInterrupt
            left -= 1
            return real(self, *arguments)

        return once

    with monkeypatch.context() as patch:
        for name in ("rename", "replace"):
            patch.setattr(Path, name, step(name))
        if steps < 4:
            with pytest.raises(KeyboardInterrupt):
                adopt(bake.folder)
        else:
            adopt(bake.folder)
    with hold(bake.folder):
        assert CaptureImages(bake.folder).prepared is not None
    found = {name: data for name, data in contents(bake.folder).items() if ".partial" not in name}
    assert found == expected


@pytest.mark.lengthy
def test_a_shard_adopts_what_is_prepared(bake: Bake, tmp_path: Path) -> None:
    assert bake.run(Reporter(), shard=Shard(0, 0))
    as_before(bake.folder)
    for number in (1, 2):
        assert bake.run(Reporter(), shard=Shard(number, 2))
    assert bake.run(Reporter())
    whole = replace(bake, folder=tmp_path / "whole")
    assert whole.run(Reporter())
    assert contents(bake.folder) == contents(whole.folder)


@pytest.mark.lengthy
def test_a_damaged_record_is_prepared_again(bake: Bake, tmp_path: Path) -> None:
    assert bake.run(Reporter())
    expected = contents(bake.folder)
    as_before(bake.folder)
    record = bake.folder / FORMER / "prepared.json"
    record.write_text(record.read_text().replace('"footprint": 0.5', '"footprint": 0.25'))
    files.write_json(bake.folder / "bake.json", {**bake._identity(), "blender": "4.5.0"})
    assert bake.run(Reporter())
    assert contents(bake.folder) == expected
