"""A folder in which the documented names exist, made once, and the running of documented commands in copies of it."""

from __future__ import annotations

import io
import json
import os
import re
import runpy
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pytest
from classes import shortened, variants
from documented import ROOT, Command
from npm_package import ENVIRONMENT, WEB
from typer.testing import CliRunner

import srbf.demo
from srbf.cli import app
from srbf.io.image import write_image
from srbf.report import abrdf_mosaic, canvas
from srbf.sphere import random_directions
from srbf.viewer.server import ViewerServer

BLENDS = {"scene": "Table", "room": "Room"}  # NAME.blend -> its receiver's name in the documentation
SAME = {
    "scene.blend": ["SCENE.blend", "their.blend"],
    "capture": ["CAPTURE", "out/caustics/capture", "out/loft/capture"],
    "asset": ["ASSET", "OTHER", "out/caustics/asset", "out/caustics/maps", "out/loft/asset"],
    "model.glb": ["SCENE.glb", "ROOM.glb", "out/caustics/scene.glb", "out/loft/scene.glb"],
}
FEWER = """
import bpy, sys
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
for name in ("Ring", "LeaningRing", "Angel", "AngelWings", "AngelHalo", "CrystalBall", "TableLegs"):
    bpy.data.objects.remove(bpy.data.objects[name])  # one glass is left, of the table alone: its transmittance is fitted in a second
bpy.data.objects["Floor"].scale *= 0.3
bpy.data.objects["Table"].name = sys.argv[2]
if sys.argv[2] != "Table":
    bpy.data.objects.remove(bpy.data.objects["AngelFoot"])
    for name, kind in (("Desk light", "POINT"), ("Window", "AREA")):
        light = bpy.data.objects.new(name, bpy.data.lights.new(name, kind))
        light.data.energy, light.location = 50, (0.3, 0.2, 1)
        bpy.context.scene.collection.objects.link(light)
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
"""
FRAMES = {"frames": [{"lights": [{"kind": "directional", "direction": [0, 0.5, 1], "color": [1, 1, 1]}]}, {"lights": []}]}
FEW = {"bake.cubemap_set.SURFELS": 200, "bake.light_sets.SURFEL_PLACES": 400, "visibility.patches.FEWEST_CELLS": 400}
FEW |= {f"visibility.transfer_operator.{name}_RAYS": 64 for name in ("FEWEST", "MOST", "SURFEL")}
FEW |= {"methods.transfer.MOST_CLUSTERS": 4, "bake.light_sets.FINGERPRINT_PATCHES": 128}
FEW |= {f"visibility.transfer_basis.{name}": 40 for name in ("PLACED", "MOST_PLACED", "NEAR", "SPOTS")}
OUTPUTS = ("-o", "--output", "--save")
PATH = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])  # as activated
LONGEST = 120  # s, of one command that is not ours to shorten


def prepare(folder: Path) -> None:
    """Fill a folder with all that the documented commands start from, each as small as it can be."""
    place = Workplace(folder)
    for name, receiver in BLENDS.items():
        scene = folder / f"{name}.blend"
        place.python("data/scenes/caustics.py", str(scene))
        assert (said := place.process([sys.executable, "-c", FEWER, str(scene), receiver])) is None, said
    place.python("data/scenes/closed_form_scenes.py", "torus", "torus.blend")
    for text in (
        "srbf bake scene.blend -o capture --receiver lightmap:Table",
        "srbf bake scene.blend -o indirect --receiver lightmap:Table --transport indirect",
        "srbf bake scene.blend -o quarter --receiver lightmap:Table --share 1/4",
        "srbf bake torus.blend -o torus --receiver lightmap:Torus --domain sphere",
        "srbf fit capture -o asset -k 25",
        "srbf export asset --target gltf -o gltf",
    ):
        assert (said := place.failure_of(Command("workplace.py", 0, text))) is None, f"{text}\n  {said}"
    shutil.move(folder / "gltf" / "model.glb", folder)
    for source, names in SAME.items():
        for name in names:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (shutil.copytree if (folder / source).is_dir() else shutil.copy)(folder / source, folder / name)
    (folder / "FRAMES.json").write_text(json.dumps(FRAMES))
    (folder / "places.csv").write_text("x,y,z,nx,ny,nz\n0.1,0.2,0.5,0,0,1\n")
    for name, lights in {"dome": 12, "SYNTHRTI/Object/Dome": 49, "SYNTHRTI/Object/Test": 4}.items():
        photograph(folder / name, lights)


def photograph(folder: Path, lights: int) -> None:
    """Pictures of a wavy plane, and their light list."""
    folder.mkdir(parents=True)
    waves = np.linspace(0, 20, 96)
    normals = np.stack([0.3 * np.sin(waves), 0.3 * np.cos(waves), np.full(96, 0.9)], axis=1)
    lines = [str(lights)]
    for i, direction in enumerate(random_directions(lights, "hemisphere", np.random.default_rng(lights))):
        lit = np.clip(normals @ direction, 0, 1)[:, None] * [255, 200, 130]
        write_image(folder / f"{i:02d}.png", lit.reshape(8, 12, 3).astype(np.uint8), "uint8")
        lines.append(f"{i:02d}.png " + " ".join(map(str, direction)))
    (folder / "dirs.lp").write_text("\n".join(lines) + "\n")


class Workplace:
    """A folder in which documented commands run one after the other, each with the outputs of those before."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.made: set[str] = set()

    def failure_of(self, command: Command) -> str | None:
        """Run a command of class `run`, once for each of its choices; what the first that failed was, and said."""
        program = command.words[0]
        before = frozenset(self.made)
        for words in variants(command):
            self.made = set(before)  # a choice does not resume what another has written
            self._make_room(words)
            words = [*words, *shortened(command)]
            if program == "srbf":
                said = self.srbf(words)
            elif program == "python":
                said = self.python(*words)
            elif program == "npm":
                said = self.npm(words, command.variables)
            else:
                said = self.process([shutil.which(program, path=PATH) or program, *words])
            if said is not None:
                return f"run as: {program} {' '.join(words)}\n{said}"
        return None

    def _make_room(self, words: Sequence[str]) -> None:
        """Take away what was prepared under the name of an output, unless a command before has written it."""
        for flag, name in zip(words, words[1:], strict=False):
            if flag in OUTPUTS:
                path = self.folder / name
                if name not in self.made and path.exists():
                    shutil.rmtree(path) if path.is_dir() else path.unlink()
                path.parent.mkdir(parents=True, exist_ok=True)
                self.made.add(name)

    def srbf(self, words: list[str]) -> str | None:
        """Run `srbf` in this process, demos small, a page that it serves fetched once and left by Ctrl-C; what it said if it failed."""
        fetched: list[bytes] = []
        serve = ViewerServer.serve_forever

        def visited(server: ViewerServer, *_args: Any, **_named: Any) -> None:
            thread = Thread(target=serve, args=(server, 0.02), daemon=True)
            thread.start()
            with urllib.request.urlopen(server.url, timeout=20) as response:
                fetched.append(response.read())
            server.shutdown()
            thread.join()
            raise KeyboardInterrupt

        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(self.folder)
            patch.setenv("PATH", PATH)
            patch.setenv("PWD", str(self.folder))
            patch.setattr("webbrowser.open", lambda url: True)
            patch.setattr(ViewerServer, "serve_forever", visited)
            patch.setattr(
                srbf.demo, "SCENES", {name: replace(scene, size=(24, 18), published=(28, 20)) for name, scene in srbf.demo.SCENES.items()}
            )
            patch.setattr(srbf.demo, "HOLDOUT_SAMPLES", 1)
            for module in (canvas, abrdf_mosaic):
                patch.setattr(module, "DPI", 40)
            for name, few in FEW.items():
                patch.setattr(f"srbf.{name}", few)
            done = CliRunner().invoke(app, words)
        if done.exit_code:
            return f"{done.output}{done.exception!r}"
        if words[0] == "view" and "--save" not in words and not (fetched and b"<html" in fetched[0]):
            return "expected a page to be served, found none"
        return None

    def python(self, script: str, *words: str) -> str | None:
        """Run a script of ours in a process, a benchmark in this one with its small fits; what it said if it failed."""
        if not script.startswith("benchmarks/"):
            return self.process([sys.executable, str(ROOT / script), *words])
        said, status = io.StringIO(), 0
        with pytest.MonkeyPatch.context() as patch, redirect_stdout(said), redirect_stderr(said):
            patch.chdir(self.folder)
            patch.setenv("PATH", PATH)
            patch.setenv("PWD", str(self.folder))
            patch.setattr(sys, "argv", [script, *words])
            patch.syspath_prepend(str((ROOT / script).parent))
            try:
                runpy.run_path(str(ROOT / script), run_name="__main__")
            except SystemExit as ended:
                if isinstance(ended.code, str):
                    said.write(ended.code)
                status = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
            except Exception as error:  # noqa: BLE001 - what a process would end with
                said.write(f"Traceback: {error!r}")
                status = 1
        return None if status == 0 or misses_a_bar(status, said.getvalue()) else f"status {status}\n{said.getvalue()[-4000:]}"

    def process(self, words: Sequence[str]) -> str | None:
        """Run a program; what it said if it failed."""
        environment = {**os.environ, "PATH": PATH, "PYTHONPATH": str(ROOT), "PWD": str(self.folder)}  # Blender believes PWD
        done = subprocess.run(
            list(words),
            cwd=self.folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=LONGEST,
            check=False,
            stdin=subprocess.DEVNULL,
        )
        return None if done.returncode == 0 else f"status {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-2000:]}"

    def npm(self, words: Sequence[str], variables: dict[str, str]) -> str | None:
        """Run npm in web/: the package packed, or the examples served, fetched once and ended; what was wrong."""
        program = shutil.which("npm", path=PATH)
        assert program is not None
        if words[0] == "pack":
            done = subprocess.run(
                [program, "pack", "--ignore-scripts", "--pack-destination", str(self.folder)],
                cwd=WEB, env=ENVIRONMENT, capture_output=True, text=True, timeout=LONGEST, check=False,
            )  # fmt: skip
            version = json.loads((WEB / "package.json").read_text())["version"]
            return None if (self.folder / f"srbf-{version}.tgz").is_file() else done.stderr
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        given = {name: str(self.folder / value) for name, value in variables.items()}
        command = [program, *words, "--", "--host", "127.0.0.1", "--port", str(port), "--strictPort"]
        log = self.folder / "example.log"
        with log.open("w") as output:
            process = subprocess.Popen(command, cwd=WEB, env=ENVIRONMENT | given, stdout=output, stderr=output, start_new_session=True)
        try:
            return None if b"<script" in fetched(f"http://127.0.0.1:{port}/", process) else log.read_text()
        finally:
            os.killpg(process.pid, signal.SIGTERM)
            process.wait(20)


def misses_a_bar(status: int, said: str) -> bool:
    """What benchmarks end with where a bar is missed, as they are here."""
    return status == 1 and "Traceback" not in said and re.search(r"\b(bar|miss)", said) is not None


def fetched(url: str, server: subprocess.Popen[bytes]) -> bytes:
    """What a server that is about to start returns; nothing where it ends or half a minute is up."""
    until = time.monotonic() + 30
    while time.monotonic() < until and server.poll() is None:
        try:
            with urllib.request.urlopen(url, timeout=5) as response:
                return response.read()
        except OSError:
            time.sleep(0.1)
    return b""
