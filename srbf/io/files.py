"""Atomic writes of files and folders, and paths of manifests that stay inside their folder."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath
from typing import Any
from uuid import uuid4

from srbf.errors import ImageError, ManifestError, OutputExistsError, SrbfError


class WriteError(SrbfError, OSError):
    """A target that cannot be written: read-only, full, or not a folder."""


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """A temporary name beside `path` to write to; on success it is flushed to disk and renamed, on failure removed."""
    temporary = path.with_name(
        f".{path.stem}.{os.getpid()}-{uuid4().hex[:8]}.partial{path.suffix}"
    )  # several machines may share the folder
    try:
        yield temporary
        with open(temporary, "rb+") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    except (OSError, SrbfError) as error:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        if isinstance(error, SrbfError) and not isinstance(error, ImageError):
            raise
        raise WriteError(f"cannot write {path}: {_reason(error, path)}") from error
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _reason(error: Exception, path: Path) -> str:
    if not path.parent.is_dir():
        return f"there is no folder {path.parent}; make it first"
    if not os.access(path.parent, os.W_OK):
        return f"{path.parent} is read-only; choose a folder that can be written"
    if isinstance(error, SrbfError):
        free = shutil.disk_usage(path.parent).free
        text = str(error)
        return f"no space left on the disk ({free} bytes free); free some and run again" if free < 1 << 20 else text
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}; choose a folder that can be written"
    return str(error)


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text atomically."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(path: Path, value: Any) -> None:
    """Write JSON atomically: keys in the given order, without NaN, so that equal values give equal bytes."""
    write_text(path, json.dumps(value, indent=1, allow_nan=False) + "\n")


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object from a file; ManifestError if there is none."""
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise ManifestError(f"expected {path}, found no such file") from error
    except OSError as error:
        raise ManifestError(f"cannot read {path}: {error.strerror}") from error
    except ValueError as error:  # JSONDecodeError, UnicodeDecodeError
        raise ManifestError(f"expected JSON in {path}, found a syntax error: {error}") from error
    if not isinstance(value, dict):
        raise ManifestError(f"expected a JSON object in {path}, found {type(value).__name__}")
    return value


def make_folder(path: Path) -> None:
    """Make a folder and its parents; WriteError if that fails."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise WriteError(f"cannot make folder {path}: {error.strerror}; choose a folder that can be written") from error


def inside(folder: Path, name: str, manifest: Path) -> Path:
    """The file `name` of a manifest under its folder; ManifestError if it would leave the folder."""
    pure = PurePosixPath(name)
    try:
        resolved = (folder / pure).resolve()
    except (OSError, RuntimeError, ValueError) as error:  # a loop of links, a null byte
        raise ManifestError(f"expected a path that can be followed in {manifest.name}, found {name!r}") from error
    if not name or "\\" in name or pure.is_absolute() or ".." in pure.parts or not resolved.is_relative_to(folder.resolve()):
        raise ManifestError(f"expected a relative path inside {folder}, found {name!r} in {manifest.name}")
    return folder / pure


def sha256_of(path: Path) -> str:
    """Hex SHA-256 of a file."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def checksums(folder: Path, manifest: str) -> dict[str, str]:
    """Hex SHA-256 of every file under a folder except its `manifest`, sorted by relative path."""
    found = sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file() and p != folder / manifest)
    return {name: sha256_of(folder / name) for name in found}


@contextmanager
def atomic_folder(path: Path, force: bool, marker: str) -> Iterator[Path]:
    """A temporary folder beside `path` to fill, renamed to it on success.

    An existing `path` is replaced only with `force`, and only where it is empty or holds the file `marker`, so that a wrong
    path never deletes a folder of something else.
    """
    check_replaceable(path, force, marker)
    path = path.resolve()  # "." has no name for a temporary sibling, and the target of a link is replaced
    make_folder(path.parent)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.partial")
    shutil.rmtree(temporary, ignore_errors=True)  # of a killed process with this number
    make_folder(temporary)
    try:
        yield temporary
        if path.exists():
            old = path.with_name(f".{path.name}.{os.getpid()}.old")
            path.replace(old)
            temporary.replace(path)
            shutil.rmtree(old) if old.is_dir() else old.unlink()
        else:
            temporary.replace(path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def check_replaceable(path: Path, force: bool, marker: str) -> None:
    """OutputExistsError if `path` exists and may not be replaced."""
    if not path.exists():
        return
    if not force:
        raise OutputExistsError(f"expected no {path} yet, found one; choose another, or `force=True`")
    if not path.is_dir() or (any(path.iterdir()) and not (path / marker).is_file()):
        raise OutputExistsError(f"`force=True` replaces only a folder with {marker}, and {path} is not one; choose another")
    folders = [p for p in path.iterdir() if p.is_dir() and p.name not in ("lights", "direct")]
    if others := [p.name for p in folders if not _listed(p, path / marker)]:
        raise OutputExistsError(f"`force=True` would delete the folder {others[0]!r} inside {path}; move it, or choose another")


def _listed(folder: Path, manifest: Path) -> bool:
    """Whether a manifest beside `folder` has the checksum of every file in it, such as the code of an export."""
    try:
        known = read_json(manifest).get("sha256", {})
    except ManifestError:
        return False
    return isinstance(known, dict) and all(
        p.relative_to(manifest.parent).as_posix() in known for p in folder.rglob("*") if not p.is_dir() or p.is_symlink()
    )
