"""Failures that a bake must survive: `make torture`, or `python benchmarks/torture.py --minutes 10 [--seed N] [--row WORD]`.

Kills, full disks, damaged files, hung and faulty workers, concurrent processes, hostile scenes. After each, the same command runs again,
and its capture is compared bit for bit with an undisturbed one. Prints one table; exits 1 if anything was lost, with how to reproduce it.
Rows marked (fake) use a Blender that renders by a formula, with the same host.
"""

from __future__ import annotations

import argparse
import importlib.util
import itertools
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import hostility
import numpy as np
from faults import Lab, LostError, Strike, contents, fake_lab, wait_for_orphans

HERE = Path(__file__).resolve().parent
SCENES = HERE.parent / "data" / "scenes"
WORKER_TIMEOUT = "2"  # seconds; the fake responds in a thousandth of that
Trials = Iterator[Callable[[], object]]
KINDS_OF_BAKE = ((), ("--transport", "indirect", "--keep-accumulation"), ("--samples", "auto"))
DAMAGES = ("truncated", "emptied", "flipped", "zeroed", "removed")
FAULTY = ("nan", "short", "small", "wrong", "error")


class Labs:
    """The labs that rows share, made on first use."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._made: dict[tuple[str, ...], Lab] = {}

    def fake(self, *flags: str) -> Lab:
        if flags not in self._made:
            self._made[flags] = fake_lab(self._folder / f"fake{len(self._made)}", *flags)
        return self._made[flags]

    def real(self) -> Lab:
        """A square under a wall, by the bpy module."""
        if ("bpy",) not in self._made:
            folder = self._folder / "real"
            folder.mkdir()
            scene = folder / "scene.blend"
            line = [sys.executable, str(SCENES / "closed_form_scenes.py"), "occluder", str(scene)]
            subprocess.run(line, check=True, capture_output=True, timeout=120)
            lab = self._made["bpy",] = Lab(folder, scene)
            lab.measure()
        return self._made["bpy",]

    def place(self, name: str) -> Path:
        made = self._folder / name
        made.mkdir()
        return made


def killed_at_every_write(labs: Labs, rng: np.random.Generator) -> Trials:
    """kill -9 of the host before each file operation of a bake (fake)"""
    yield from _struck("kill", labs, rng)


def disk_full_at_every_write(labs: Labs, rng: np.random.Generator) -> Trials:
    """no space left from each file operation on (fake)"""
    yield from _struck("full", labs, rng)


def _struck(kind: str, labs: Labs, rng: np.random.Generator) -> Trials:
    trials = [(lab, n) for lab in (labs.fake(*flags) for flags in KINDS_OF_BAKE) for n in range(1, lab.operations + 1)]

    def trial(lab: Lab, n: int) -> None:
        folder = lab.fresh()
        ended = lab.run(folder, strike=Strike(kind, n, folder))
        if kind == "full" and ended.status != 0:
            lab.refuse(ended)
        folder.mkdir(exist_ok=True)
        lab.go_on(folder)

    for i in rng.permutation(len(trials)):
        yield partial(trial, *trials[i])


def killed_again_and_again(labs: Labs, rng: np.random.Generator) -> Trials:
    """kill -9 of one bake up to ten times in a row (fake)"""

    def trial(lab: Lab, seed: int) -> None:
        steps = np.random.default_rng(seed)
        folder = lab.fresh()
        for _ in range(10):
            if lab.run(folder, strike=Strike("kill", int(steps.integers(5, 80)), folder)).status == 0:
                break
        lab.go_on(folder)

    for i in itertools.count():
        yield partial(trial, labs.fake(*KINDS_OF_BAKE[i % 3]), int(rng.integers(1 << 31)))


def killed_while_replacing(labs: Labs, rng: np.random.Generator) -> Trials:
    """kill -9 while --force empties a finished capture of other settings (fake)"""
    lab, other = labs.fake(), labs.fake("--seed", "1")
    finished = labs.place("finished") / "capture"
    other.succeed(other.run(finished))

    def trial(n: int) -> None:
        folder = lab.fresh()
        shutil.copytree(finished, folder)
        ended = lab.run(folder, "--force", strike=Strike("kill", n, folder))
        if ended.status != -signal.SIGKILL:
            lab.succeed(ended)
        lab.go_on(folder, "--force")

    for n in rng.permutation(60) + 1:
        yield partial(trial, int(n))


def killed_at_random(labs: Labs, rng: np.random.Generator) -> Trials:
    """kill -9 of the host at a random moment"""

    def trial(after: float) -> None:
        lab = labs.real()
        folder = lab.fresh()
        lab.kill(folder, lab.start(folder), after, lambda host, workers: [host], signal.SIGKILL)
        folder.mkdir(exist_ok=True)
        lab.go_on(folder)

    while True:
        yield partial(trial, _moment(labs.real(), rng))


def all_killed_at_random(labs: Labs, rng: np.random.Generator) -> Trials:
    """kill -9 of host and workers together at a random moment"""

    def trial(after: float, flags: list[str]) -> None:
        lab = labs.real()
        folder = lab.fresh()
        lab.kill(folder, lab.start(folder, *flags), after, lambda host, workers: [host, *workers], signal.SIGKILL)
        lab.go_on(folder)

    for flags in itertools.cycle(([], ["--workers", "2"])):
        yield partial(trial, _moment(labs.real(), rng), flags)


def worker_killed(labs: Labs, rng: np.random.Generator) -> Trials:
    """kill -9 of the worker at a random moment: replaced silently"""

    def trial(after: float) -> None:
        lab = labs.real()
        folder = lab.fresh()
        lab.succeed(lab.kill(folder, lab.start(folder), after, lambda host, workers: workers, signal.SIGKILL))
        compare_again(lab, folder)

    while True:
        yield partial(trial, _moment(labs.real(), rng))


def interrupted(labs: Labs, rng: np.random.Generator) -> Trials:
    """Ctrl-C at a random moment"""

    def trial(after: float) -> None:
        lab = labs.real()
        folder = lab.fresh()
        process = lab.start(folder)
        _wait(lambda: folder.exists() or process.poll() is not None)  # before that nothing has begun, Python itself perhaps not
        ended = lab.kill(folder, process, after, lambda host, workers: [host], signal.SIGINT)
        over = "srbf: baked" in ended.said  # it met Python on its way out
        if not over and ended.status != 0 and (ended.status != 1 or "Traceback" in ended.said or "srbf:" not in ended.said):
            raise LostError(f"Ctrl-C after {after:.2f} s ended as {ended.status}: {ended.said.strip()[-400:]!r}")
        if ended.status != 0 and (folder / "capture.json").is_file():
            told = {Path(light["file"]).stem for light in json.loads((folder / "capture.json").read_text())["lights"]}
            if not {path.stem for path in (folder / "accumulation").glob("[0-9]*")} <= told:  # of a finished bake they are being removed
                raise LostError(f"Ctrl-C after {after:.2f} s left lights that the manifest does not list")
        folder.mkdir(exist_ok=True)
        lab.go_on(folder)

    while True:
        yield partial(trial, float(rng.uniform(0, 1.2)) * labs.real().seconds)


def _moment(lab: Lab, rng: np.random.Generator) -> float:
    return float(rng.uniform(0.2, 1.6) * lab.seconds + 1)  # the command loads its libraries for about a second; the lab's are loaded


def compare_again(lab: Lab, folder: Path) -> None:
    """Compare the bits before and after another run of the command."""
    found = contents(folder)
    lab.go_on(folder)
    if contents(folder) != found:
        raise LostError("the finished bake was not whole")


def disk_filled(labs: Labs, rng: np.random.Generator) -> Trials:
    """a small disk that another process fills up and frees (fake)"""
    disk = labs.place("disk")

    def trial(after: float) -> None:
        lab = labs.fake()
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(disk)], capture_output=True, text=True)
        if mounted.returncode:
            raise Unavailable(f"no tmpfs here: {mounted.stderr.strip()}")
        try:
            folder = disk / "capture"
            process = lab.start(folder, SRBF_FAULT="slow")
            _wait(lambda: (folder / "lights").is_dir() or process.poll() is not None)
            time.sleep(after)
            _fill(disk / "ballast")
            said = process.communicate(timeout=60)[1]
            (disk / "ballast").unlink()
            if process.returncode != 0 and (process.returncode != 1 or "Traceback" in said):
                raise LostError(f"a full disk ended as {process.returncode}: {said.strip()[-400:]!r}")
            lab.go_on(folder)
        finally:
            subprocess.run(["umount", "--lazy", str(disk)], check=True)

    while True:
        yield partial(trial, float(rng.uniform(0, 0.5)))


def _fill(ballast: Path) -> None:
    with open(ballast, "wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(4096))
        except OSError:
            return


def _wait(until: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 30
    while not until():
        if time.monotonic() > deadline:
            raise LostError("nothing happened for 30 s")
        time.sleep(0.005)


def damaged_files(labs: Labs, rng: np.random.Generator) -> Trials:
    """a file of an unfinished capture truncated, emptied, flipped, zeroed or removed (fake)"""
    half = labs.place("half")
    trials = []
    for number, flags in enumerate(KINDS_OF_BAKE):
        lab = labs.fake(*flags)
        begun = half / str(number)
        lab.run(begun, strike=Strike("kill", int(0.7 * lab.operations), begun))
        wait_for_orphans(begun)
        names = sorted(
            p.relative_to(begun) for p in begun.rglob("*") if p.is_file() and not p.name.startswith(".") and p.name != "bake.log"
        )
        trials += [(lab, begun, name, damage) for name in names for damage in DAMAGES]

    def trial(lab: Lab, begun: Path, name: Path, damage: str, place: float) -> None:
        folder = lab.fresh()
        shutil.copytree(begun, folder)
        _damage(folder / name, damage, place)
        ended = lab.run(folder)
        if ended.status != 0:  # the small texts may be refused, never wrongly resumed
            if name.name not in ("bake.json", "capture.json", "curve.json"):
                raise LostError(f"{name} {damage} at {place:.3f} ended as {ended.status}: {ended.said.strip()[-400:]!r}")
            lab.refuse(ended)
            lab.succeed(lab.run(folder, "--restart"))
        try:
            lab.go_on(folder)
        except LostError as error:
            raise LostError(f"{name} {damage} at {place:.3f}: {error}") from error

    for i in rng.permutation(len(trials)):
        yield partial(trial, *trials[i], float(rng.random()))


def _damage(path: Path, how: str, place: float) -> None:
    data = bytearray(path.read_bytes())
    at = int(place * len(data))
    if how == "removed":
        path.unlink()
        return
    if how == "truncated":
        data = data[:at]
    elif how == "emptied":
        data = bytearray()
    elif how == "flipped" and data:
        data[at] ^= 1 << int(place * 1e6) % 8
    elif how == "zeroed":
        data[at : at + 64] = bytes(len(data[at : at + 64]))
    path.write_bytes(bytes(data))


def hung_workers(labs: Labs, rng: np.random.Generator) -> Trials:
    """a worker that hangs at one light: replaced (fake)"""
    yield from _once(labs, rng, "stop-once")


def dying_workers(labs: Labs, rng: np.random.Generator) -> Trials:
    """a worker that crashes once at one light: tried again (fake)"""
    yield from _once(labs, rng, "die-once")


def _once(labs: Labs, rng: np.random.Generator, kind: str) -> Trials:
    state = labs.place(kind) / "struck"

    def trial(lab: Lab, light: int) -> None:
        state.unlink(missing_ok=True)
        folder = lab.fresh()
        fault = {"SRBF_FAULT": f"{kind}:{light}", "SRBF_FAULT_STATE": str(state), "SRBF_UNCONFINED": "1"}
        lab.succeed(lab.run(folder, "--worker-timeout", WORKER_TIMEOUT, **fault))
        if not state.exists():
            raise LostError("the fault did not occur")
        compare_again(lab, folder)

    for i in itertools.count():
        yield partial(trial, labs.fake(*KINDS_OF_BAKE[i % 3]), int(rng.integers(7)))


def deadly_lights(labs: Labs, rng: np.random.Generator) -> Trials:
    """a light at which every worker crashes or hangs: reported, the bake continues (fake)"""

    def trial(kind: str, light: int) -> None:
        lab = labs.fake()
        folder = lab.fresh()
        ended = lab.run(folder, "--worker-timeout", WORKER_TIMEOUT, SRBF_FAULT=f"{kind}:{light}")
        lab.refuse(ended, f"light {light}")
        kept = {name: data for name, data in contents(folder).items() if name.startswith("lights/")}
        whole = {name: data for name, data in lab.whole.items() if name.startswith("lights/") and name != f"lights/{light:04d}.exr"}
        if kept != whole:
            raise LostError(f"{kind}:{light} took more than that light: {sorted(set(whole) - set(kept))}")
        lab.go_on(folder)

    for kind in itertools.cycle(("die", "stop")):
        yield partial(trial, kind, int(rng.integers(7)))


def lying_workers(labs: Labs, rng: np.random.Generator) -> Trials:
    """results that are NaN, truncated, of another size or light, errors; invalid lines between them (fake)"""

    def trial(kind: str, light: int) -> None:
        lab = labs.fake()
        folder = lab.fresh()
        ended = lab.run(folder, "--worker-timeout", WORKER_TIMEOUT, SRBF_FAULT=f"{kind}:{light}")
        if kind == "garbage":
            lab.succeed(ended)
        else:
            lab.refuse(ended)
        lab.go_on(folder)

    for kind in itertools.cycle((*FAULTY, "garbage")):
        yield partial(trial, kind, int(rng.integers(7)))


def rivals(labs: Labs, rng: np.random.Generator) -> Trials:
    """two to four processes on one folder at once: one bakes, the others are refused (fake)"""

    def trial(count: int) -> None:
        lab = labs.fake()
        folder = lab.fresh()
        processes = [lab.start(folder, SRBF_FAULT="slow") for _ in range(count)]
        said = [process.communicate(timeout=60)[1] for process in processes]
        if not any(process.returncode == 0 for process in processes):
            raise LostError(f"none of {count} baked: {said}")
        for process, text in zip(processes, said, strict=True):
            if process.returncode != 0 and (process.returncode != 1 or "is baking into" not in text):
                raise LostError(f"a rival ended as {process.returncode}: {text.strip()[-400:]!r}")
        lab.go_on(folder)

    while True:
        yield partial(trial, int(rng.integers(2, 5)))


def stale_leavings(labs: Labs, rng: np.random.Generator) -> Trials:
    """locks, holders, scratch folders and partial files of killed processes (fake)"""

    def trial(lab: Lab, n: int) -> None:
        folder = lab.fresh()
        lab.run(folder, strike=Strike("kill", n, folder))
        folder.mkdir(exist_ok=True)
        (folder / ".lock").touch()
        (folder / ".holder.json").write_text(json.dumps({"host": "elsewhere", "pid": 1, "since": "2001-01-01 00:00:00"}))
        (folder / ".scratch" / "worker0").mkdir(parents=True, exist_ok=True)
        (folder / ".scratch" / "worker0" / "light_1.npy").write_bytes(b"half an array")
        for place in ("lights", "accumulation", "direct"):
            if (folder / "bake.json").is_file() and (folder / place).is_dir():  # none is written there before that
                (folder / place / ".0001.4711-dead.partial.exr").write_bytes(b"half an image")
        lab.go_on(folder)

    for i in itertools.count():
        yield partial(trial, labs.fake(*KINDS_OF_BAKE[i % 3]), int(rng.integers(2, 120)))


def hostile_scenes(labs: Labs, rng: np.random.Generator) -> Trials:
    """a .blend that tries to run code, write files or spoil the pixels"""
    place = labs.place("hostile")
    twin = hostility.harmless_twin(place / "twin")
    for i, chosen in enumerate(hostility.choices()):
        yield partial(hostility.withstand, place / str(i), chosen, twin)


class Unavailable(Exception):
    """The reason why this machine cannot run a row."""


ROWS: dict[Callable[[Labs, np.random.Generator], Trials], float] = {  # and their share of the time
    killed_at_every_write: 6,
    killed_again_and_again: 1,
    killed_while_replacing: 1,
    disk_full_at_every_write: 3,
    disk_filled: 1,
    damaged_files: 3,
    hung_workers: 1,
    dying_workers: 0.5,
    deadly_lights: 1,
    lying_workers: 0.7,
    rivals: 0.7,
    stale_leavings: 0.7,
    killed_at_random: 2,
    all_killed_at_random: 1,
    worker_killed: 1.5,
    interrupted: 1.5,
    hostile_scenes: 2,
}
BY_BLENDER = {killed_at_random, all_killed_at_random, worker_killed, interrupted, hostile_scenes}


def torture(seconds: float, seed: int, words: str = "", say: Callable[[str], None] = print) -> int:
    """Run every row whose name contains `words`, for its share of `seconds`; returns the number of losses."""
    ends, lost, total = time.monotonic() + seconds, [], 0
    rows = {row: share for row, share in ROWS.items() if words in row.__name__}
    say(f"{'what':<92}{'tried':>7}{'lost':>6}{'seconds':>9}")
    with tempfile.TemporaryDirectory(prefix="srbf-torture-") as folder:
        labs = Labs(Path(folder).resolve())
        for row in list(rows):
            share = (ends - time.monotonic()) * rows[row] / sum(rows.values())
            del rows[row]
            tried, failures, note, began = 0, [], "", time.monotonic()
            if row in BY_BLENDER and importlib.util.find_spec("bpy") is None:
                note = "this Python has no bpy"
            else:
                try:
                    for trial in row(labs, np.random.default_rng(seed)):
                        try:
                            trial()
                        except LostError as error:
                            failures.append(f"{row.__name__}, trial {tried} of --seed {seed}: {error}")
                        tried += 1
                        if time.monotonic() - began > share:
                            break
                except Unavailable as error:
                    note = str(error)
            say(f"{row.__doc__:<92}{tried:>7}{len(failures):>6}{time.monotonic() - began:>9.0f}  {note}".rstrip())
            lost += failures
            total += tried
    say(f"{'all':<92}{total:>7}{len(lost):>6}")
    for line in lost:
        say(f"lost: {line}")
    return len(lost)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=9.0, help="of all rows together, plus the last trial of each")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--row", default="", help="only rows whose function's name contains this")
    options = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # otherwise, in the background of a script, all would ignore Ctrl-C
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    sys.exit(torture(60 * options.minutes, options.seed, options.row) > 0)


if __name__ == "__main__":
    main()
