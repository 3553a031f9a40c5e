"""The folder of a bake: locking it, whether a bake may resume or extend what it holds, and emptying it safely."""

from __future__ import annotations

import os
import shutil
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from srbf.bake import accumulation
from srbf.bake.accumulation import ACCUMULATION
from srbf.bake.former_folder import FORMER, adopt
from srbf.bake.images import PREPARED, SCENE_FILE, SEAMS
from srbf.bake.light_sets import LIGHT_SET_FILE, PATCHES_FILE
from srbf.bake.shard import Shard
from srbf.channels import CHANNELS, file_name
from srbf.cubemap_transport import BOUNCES_FILE, TESTED_FILE, VISIBILITY_FILE
from srbf.errors import BakeError, ManifestError, MissingLibraryError, OutputExistsError
from srbf.io import files
from srbf.receiver_images import MANIFEST
from srbf.visibility.transfer_operator import OPERATOR_FILE, SURFELS_FILE

STATE = "bake.json"  # exists while a bake is unfinished: its settings
LOG = "bake.log"
LONGEST_LOG = 16 << 20  # bytes of Blender's output
SCRATCH = ".scratch"
LOCK = ".lock"
HOLDER = ".holder.json"
LOCK_PATIENCE = 5.0  # seconds to wait for the folder's lock, which shards take briefly, one after the other
BEFORE_IMAGES = (
    LOCK,
    HOLDER,
    SCRATCH,
    LOG,
    ACCUMULATION,
    FORMER,
    LIGHT_SET_FILE,
    PATCHES_FILE,
    SURFELS_FILE,
    OPERATOR_FILE,
    VISIBILITY_FILE,
    BOUNCES_FILE,
    TESTED_FILE,
    "lights",
    "direct",
    "harmonics",
)  # what a bake may leave that never wrote an image
WRITTEN = (
    "lights",
    "direct",
    "harmonics",
    *(file_name(name) for name in (*CHANNELS, SEAMS)),
    "uv.json",
    SCENE_FILE,
    LIGHT_SET_FILE,
    PATCHES_FILE,
    SURFELS_FILE,
    OPERATOR_FILE,
    VISIBILITY_FILE,
    BOUNCES_FILE,
    TESTED_FILE,
    ACCUMULATION,
    FORMER,
    SCRATCH,
    LOG,
)  # all that a bake writes


@contextmanager
def hold(folder: Path) -> Iterator[None]:
    """Hold the lock of the folder inside; the OS releases it however this process ends.

    BakeError where another process bakes into the folder, or a shard of it; OutputExistsError where it is a file.
    """
    if folder.exists() and not folder.is_dir():
        raise OutputExistsError(f"expected a folder or nothing at {folder}, found a file; choose another")
    files.make_folder(folder)
    lock = locked(folder, LOCK)
    if lock is None:
        raise BakeError(f"another process{_holder(folder)} is baking into {folder}; wait for it, or choose another folder")
    try:
        if held := _shards_held(folder):
            raise BakeError(f"other processes are baking shards {', '.join(held)} into {folder}; wait for them, or choose another folder")
        adopt(folder)
        files.write_json(folder / HOLDER, {"host": socket.gethostname(), "pid": os.getpid(), "since": time.strftime("%F %T")})
        yield
    finally:
        (folder / HOLDER).unlink(missing_ok=True)
        if folder.exists() and not any((folder / name).exists() for name in (STATE, MANIFEST)):
            (folder / LOCK).unlink(missing_ok=True)
        lock.release()


@contextmanager
def hold_shard(folder: Path, shard: Shard) -> Iterator[None]:
    """Hold the lock of one shard inside, beside other shards of as many; BakeError where another process holds it, or the folder."""
    if not folder.is_dir():
        raise BakeError(f"expected a prepared capture at {folder}, found none; run `shard=prepare` first")
    # A shard takes the folder's lock briefly, so that no bake of the whole folder runs or begins meanwhile.
    whole = locked(folder, LOCK, LOCK_PATIENCE)
    if whole is None:
        raise BakeError(f"another process{_holder(folder)} is baking all of {folder}; wait for it")
    try:
        held = _shards_held(folder)
        if others := [name for name in held if not name.endswith(f"/{shard.count}")]:
            raise BakeError(
                f"expected shards of {shard.count} in {folder}, found shard {others[0]} being baked; wait for it, or use its number"
            )
        if not held:
            adopt(folder)
        own = None if shard.name in held else locked(folder, shard.lock)
        if own is None:
            raise BakeError(f"another process is baking shard {shard.name} into {folder}; wait for it")
    finally:
        whole.release()
    try:
        yield
    finally:
        whole = locked(folder, LOCK, LOCK_PATIENCE)
        if whole is not None:
            (folder / shard.lock).unlink(missing_ok=True)  # no other process opens it meanwhile
            whole.release()
        own.release()


def locked(folder: Path, name: str, patience: float = 0.0) -> Any:
    """The lock `name`, held; None where another process holds it after `patience` seconds."""
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


def _shards_held(folder: Path) -> list[str]:
    """Names of the shards that are being baked; lock files of ended ones are deleted. The caller holds the folder's lock."""
    held = []
    for path in sorted(folder.glob(".shard-*.lock")):
        lock = locked(folder, path.name)
        if lock is None:
            held.append(path.name.removeprefix(".shard-").removesuffix(".lock").replace("-of-", "/"))
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
    """Whether the folder holds the whole bake already. With `force`, or `restart` where it is unfinished, another bake's is emptied.

    OutputExistsError or ManifestError where it can be neither resumed nor replaced.
    """
    done, begun = folder / MANIFEST, folder / STATE
    if not done.is_file() and not begun.is_file():
        others = [p for p in folder.iterdir() if p.name not in BEFORE_IMAGES and ".partial" not in p.name]
        if others or any(any((folder / name).glob("*")) for name in ("lights", "direct", "harmonics")):
            raise OutputExistsError(f"expected an empty folder or a capture at {folder}, found other files; choose another")
        return False
    finished = done.is_file() and not begun.is_file()
    try:
        recorded = files.read_json(done).get("source", {}) if finished else files.read_json(begun)
    except ManifestError as error:
        if force or (restart and not finished):
            _empty(folder)
            return False
        raise ManifestError(f"{error}; {'`force=True`' if finished else '`restart=True`'} replaces it") from error
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
        state = "a finished capture" if finished else "an unfinished capture"
        raise OutputExistsError(
            f"expected {state} of the same scene and settings at {folder}, found another {', '.join(changed)}; "
            f"choose another, or {'`force=True`' if finished else '`restart=True`'} to replace it"
        )
    _empty(folder)
    return False


def is_past_shards(folder: Path, identity: dict[str, Any]) -> bool:
    """Whether the bake is finished, all shards included. BakeError where it is not prepared, OutputExistsError where another bake is."""
    state = next((name for name in (STATE, MANIFEST) if (folder / name).is_file()), None)
    recorded = files.read_json(folder / state) if state else {}
    if recorded.get("tidying"):
        return True
    if state == MANIFEST:
        recorded = recorded.get("source", {})
    if recorded and (changed := _differences(recorded, identity)):
        raise OutputExistsError(
            f"expected a capture of the same scene and settings at {folder}, found another {', '.join(changed)}; choose another"
        )
    if state == MANIFEST and not _may_grow(folder, recorded, identity):
        return True
    if state != STATE or not (folder / ACCUMULATION / PREPARED).is_file():
        raise BakeError(f"expected a prepared capture at {folder}, found none; run `shard=prepare` first")
    return False


def sweep(folder: Path) -> None:
    """Delete what a killed process left half-written, and shorten a long log to its end."""
    log = folder / LOG
    if log.is_file() and log.stat().st_size > LONGEST_LOG:
        log.write_bytes(log.read_bytes()[-LONGEST_LOG // 16 :])
    shutil.rmtree(folder / SCRATCH, ignore_errors=True)
    for place in ("", "lights/", "direct/", "harmonics/", f"{ACCUMULATION}/"):
        for partial in folder.glob(f"{place}.*.partial*"):
            partial.unlink()


def tidy(folder: Path) -> None:
    """Delete the accumulation folder of a finished bake, and the mark that it was unfinished. If killed, the next run completes it."""
    files.write_json(folder / STATE, {"tidying": True})
    accumulation.remove(folder)
    (folder / STATE).unlink()


def _may_grow(folder: Path, recorded: dict[str, Any], asked: dict[str, Any]) -> bool:
    """Whether samples are to be added to a finished capture; OutputExistsError where its accumulation folder is gone."""
    has, wants = recorded["settings"]["samples"], asked["settings"]["samples"]
    more = not recorded.get("validation_curve") if wants == "auto" else wants > has
    if more and not any((folder / ACCUMULATION).glob("[0-9]*")):
        raise OutputExistsError(
            f"expected the accumulation of {folder}, to add to its {has} samples per texel, found none: it is kept with "
            "`keep_accumulation=True`, `samples=auto` and `time_limit`; choose another folder, or `force=True` to replace the capture"
        )
    return more


def _empty(folder: Path) -> None:
    """Delete an old capture. If killed, the next run completes it: no light of the old bake may pass for one of the new."""
    files.write_json(folder / STATE, {"emptying": True})
    (folder / MANIFEST).unlink(missing_ok=True)
    for name in WRITTEN:
        path = folder / name
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    (folder / STATE).unlink()


def _differences(recorded: dict[str, Any], asked: dict[str, Any]) -> list[str]:
    """Names of the settings in which a recorded bake differs from this one; not `samples`, which can be added."""
    changed = ["scene"] if recorded.get("scene_sha256") != asked["scene_sha256"] else []
    before, now = recorded.get("settings", {}), asked["settings"]
    names = [*now, *(name for name in before if name not in now)]  # a setting that is missing now differs too
    return changed + [name.replace("_", " ") for name in names if name != "samples" and before.get(name) != now.get(name)]
