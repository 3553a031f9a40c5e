"""The folder of a bake: who holds it, what it holds, whether a bake may go on with it, and emptying it safely."""

from __future__ import annotations

import os
import shutil
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from srbf.bake import sums
from srbf.bake.images import GEOMETRY, PREPARED, SCENE_FILE
from srbf.bake.part import Part
from srbf.bake.sums import SUMS
from srbf.capture import MANIFEST
from srbf.errors import BakeError, ManifestError, MissingLibraryError, OutputExistsError
from srbf.io import files

STATE = "bake.json"  # there while a bake is unfinished: what it was asked for
LOG = "bake.log"
LONGEST_LOG = 16 << 20  # bytes of Blender's own words
SCRATCH = ".scratch"
LOCK = ".lock"
HOLDER = ".holder.json"
FINDING_A_PLACE = 5.0  # seconds that parts may need to do so, one after the other
BEFORE_IMAGES = (LOCK, HOLDER, SCRATCH, LOG, SUMS, "lights", "direct")  # what may be there of a bake that never wrote an image
WRITTEN = (
    "lights",
    "direct",
    "ambient.exr",
    "seams.exr",
    *(f"{name}.exr" for name in GEOMETRY),
    "uv.json",
    SCENE_FILE,
    SUMS,
    SCRATCH,
    LOG,
)  # all that a bake leaves


@contextmanager
def hold(folder: Path) -> Iterator[None]:
    """Hold the folder, parts of a bake included; the system lets go of it however this process ends."""
    if folder.exists() and not folder.is_dir():
        raise OutputExistsError(f"expected a folder or nothing at {folder}, found a file; choose another -o")
    files.make_folder(folder)
    lock = locked(folder, LOCK)
    if lock is None:
        raise BakeError(f"another process{_holder(folder)} is baking into {folder}; wait for it, or choose another -o")
    try:
        if held := _parts_held(folder):
            raise BakeError(f"other processes are baking parts {', '.join(held)} into {folder}; wait for them, or choose another -o")
        files.write_json(folder / HOLDER, {"host": socket.gethostname(), "pid": os.getpid(), "since": time.strftime("%F %T")})
        yield
    finally:
        (folder / HOLDER).unlink(missing_ok=True)
        if folder.exists() and not any((folder / name).exists() for name in (STATE, MANIFEST)):
            (folder / LOCK).unlink(missing_ok=True)
        lock.release()


@contextmanager
def hold_part(folder: Path, part: Part) -> Iterator[None]:
    """Hold one part of a bake beside others of as many; BakeError where another process holds it, or all of the folder."""
    if not folder.is_dir():
        raise BakeError(f"expected a prepared capture at {folder}, found none; run `shard=prepare` first")
    # A part holds the folder for a moment, to find its place: so no bake of all of it can begin unseen, and none be under way.
    whole = locked(folder, LOCK, FINDING_A_PLACE)
    if whole is None:
        raise BakeError(f"another process{_holder(folder)} is baking all of {folder}; wait for it")
    try:
        held = _parts_held(folder)
        if others := [name for name in held if not name.endswith(f"/{part.count}")]:
            raise BakeError(
                f"expected parts of {part.count} in {folder}, found part {others[0]} being baked; wait for it, or keep to its number"
            )
        own = None if part.name in held else locked(folder, part.lock)
        if own is None:
            raise BakeError(f"another process is baking part {part.name} into {folder}; wait for it")
    finally:
        whole.release()
    try:
        yield
    finally:
        whole = locked(folder, LOCK, FINDING_A_PLACE)
        if whole is not None:
            (folder / part.lock).unlink(missing_ok=True)  # nobody opens it meanwhile
            whole.release()
        own.release()


def locked(folder: Path, name: str, patience: float = 0.0) -> Any:
    """The lock of that name, held; None where another process holds it."""
    try:
        import filelock
    except ImportError as error:
        raise MissingLibraryError("baking needs filelock: pip install filelock") from error
    lock = filelock.FileLock(str(folder / name))
    try:
        lock.acquire(timeout=patience)
    except filelock.Timeout:
        return None
    except OSError as error:
        raise files.WriteError(f"cannot write into {folder}: {error.strerror}; choose a folder that can be written") from error
    return lock


def _parts_held(folder: Path) -> list[str]:
    """Names of the parts that are being baked; what others left behind is removed. To be asked by whoever holds the folder."""
    held = []
    for path in sorted(folder.glob(".part-*.lock")):
        lock = locked(folder, path.name)
        if lock is None:
            held.append(path.name.removeprefix(".part-").removesuffix(".lock").replace("-of-", "/"))
        else:
            path.unlink(missing_ok=True)
            lock.release()
    return held


def _holder(folder: Path) -> str:
    with suppress(ManifestError, KeyError):
        holder = files.read_json(folder / HOLDER)
        return f" (process {holder['pid']} on {holder['host']}, since {holder['since']})"
    return ""


def is_finished(folder: Path, identity: dict[str, Any], force: bool, restart: bool) -> bool:
    """Whether the folder holds all that is asked for. A folder that can be neither gone on with nor replaced is refused; one that
    the user wants replaced is emptied."""
    done, begun = folder / MANIFEST, folder / STATE
    if not done.is_file() and not begun.is_file():
        others = [p for p in folder.iterdir() if p.name not in BEFORE_IMAGES and ".partial" not in p.name]
        if others or any(any((folder / name).glob("*")) for name in ("lights", "direct")):
            raise OutputExistsError(f"expected an empty folder or a capture at {folder}, found other files; choose another -o")
        return False
    finished = done.is_file() and not begun.is_file()
    try:
        recorded = files.read_json(done).get("source", {}) if finished else files.read_json(begun)
    except ManifestError as error:
        if force or (restart and not finished):
            _empty(folder)
            return False
        raise ManifestError(f"{error}; {'`force=True`' if finished else '`restart=True`'} bakes anew") from error
    if recorded.get("tidying"):
        tidy(folder)
        return is_finished(folder, identity, force, restart)
    if recorded.get("emptying"):
        _empty(folder)
        return False
    changed = _differences(recorded, identity)
    if not changed and not restart and not (force and finished):
        return finished and not _may_grow(folder, recorded, identity)
    if not (force or (restart and not finished)):
        if not changed:
            raise OutputExistsError(
                f"expected an unfinished capture to restart at {folder}, found a finished one; `force=True` replaces it"
            )
        state = "a finished capture" if finished else "a capture half done"
        raise OutputExistsError(
            f"expected {state} of the same scene and settings at {folder}, found another {', '.join(changed)}; "
            f"choose another folder, or {'`force=True`' if finished else '`restart=True`'} to bake anew"
        )
    _empty(folder)
    return False


def is_past_parts(folder: Path, identity: dict[str, Any]) -> bool:
    """Whether all parts of the bake are done and it is finished; BakeError where none is prepared, OutputExistsError where another is."""
    state = next((name for name in (STATE, MANIFEST) if (folder / name).is_file()), None)
    recorded = files.read_json(folder / state) if state else {}
    if recorded.get("tidying"):
        return True
    if state == MANIFEST:
        recorded = recorded.get("source", {})
    if recorded and (changed := _differences(recorded, identity)):
        raise OutputExistsError(
            f"expected a capture of the same scene and settings at {folder}, found another {', '.join(changed)}; choose another -o"
        )
    if state == MANIFEST and not _may_grow(folder, recorded, identity):
        return True
    if state != STATE or not (folder / SUMS / PREPARED).is_file():
        raise BakeError(f"expected a prepared capture at {folder}, found none; run `shard=prepare` first")
    return False


def sweep(folder: Path) -> None:
    """Remove what a killed process left half-written, and all but the end of a log that has grown long."""
    log = folder / LOG
    if log.is_file() and log.stat().st_size > LONGEST_LOG:
        log.write_bytes(log.read_bytes()[-LONGEST_LOG // 16 :])
    shutil.rmtree(folder / SCRATCH, ignore_errors=True)
    for place in ("", "lights/", "direct/", f"{SUMS}/"):
        for partial in folder.glob(f"{place}.*.partial*"):
            partial.unlink()


def tidy(folder: Path) -> None:
    """Drop the sums of a finished bake, and the mark that it was unfinished. Killed on the way, the next run does it."""
    files.write_json(folder / STATE, {"tidying": True})
    sums.remove(folder)
    (folder / STATE).unlink()


def _may_grow(folder: Path, recorded: dict[str, Any], asked: dict[str, Any]) -> bool:
    """Whether a finished capture is to have more samples; OutputExistsError where it is, and its sums are gone."""
    has, wants = recorded["settings"]["samples"], asked["settings"]["samples"]
    more = not recorded.get("validation_curve") if wants == "auto" else wants > has
    if more and not any((folder / SUMS).glob("[0-9]*")):
        raise OutputExistsError(
            f"expected the sums of {folder}, to add to its {has} samples a texel, found none: they are kept by `keep_accumulation=True`, "
            "`samples=auto` and `time_limit`; choose another folder, or `force=True` to bake anew"
        )
    return more


def _empty(folder: Path) -> None:
    """Remove an old capture. Killed on the way, the next run goes on: no light of the old bake may pass for one of the new."""
    files.write_json(folder / STATE, {"emptying": True})
    (folder / MANIFEST).unlink(missing_ok=True)
    for name in WRITTEN:
        path = folder / name
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    (folder / STATE).unlink()


def _differences(recorded: dict[str, Any], asked: dict[str, Any]) -> list[str]:
    """Names of what differs between a recorded bake and this one; samples may: more are added, fewer are there."""
    changed = ["scene"] if recorded.get("scene_sha256") != asked["scene_sha256"] else []
    before, now = recorded.get("settings", {}), asked["settings"]
    names = [*now, *(name for name in before if name not in now)]  # a choice that was not made again is another one too
    return changed + [name.replace("_", " ") for name in names if name != "samples" and before.get(name) != now.get(name)]
