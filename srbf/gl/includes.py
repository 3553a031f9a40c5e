"""Shader sources: `#include` once each, `#line` marks, defines after `#version`, and compile logs mapped back to file:line.

The only resolver in Python: drivers take `resolve`, translations to other languages take `dependence_order`.
`web/build/glsl_includes.ts` does the same for the npm package; tests compare the two on every stage.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from srbf.errors import ShaderError

_VERSION = re.compile(r"^\s*#\s*version\b")
_INCLUDE = re.compile(r'^\s*#\s*include\b\s*(?:"([^"]+)")?')
_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
# 0:12(3) Mesa; 0(12) NVIDIA; 0:12 Intel, AMD, ANGLE, glslang, each with or without "ERROR: " before it
_LOG_PLACE = re.compile(r"^(\s*(?:ERROR|WARNING|error|warning)?:?\s*)(\d+)(?::(\d+)(?:\(\d+\))?|\((\d+)\))", re.MULTILINE)
Defines = Mapping[str, object]  # names to what follows them on their line
# Lines of file n count from n * STRIDE: Mesa reports some errors (undeclared names) with source string 0 whatever #line said.
STRIDE = 4096


@dataclass(frozen=True)
class ShaderSource:
    """A shader ready for the driver: `text`, and `files`: the source-string number n of a log line means files[n]."""

    text: str
    files: tuple[str, ...]

    def locate(self, log: str) -> str:
        """A driver's compile log with each leading `0:12(3)`, `0(12)` or `0:12` replaced by `stages/point.frag:12`."""

        def place(match: re.Match[str]) -> str:
            lead, source, line = match[1], int(match[2]), int(match[3] or match[4])
            if STRIDE < line < STRIDE * len(self.files):
                source, line = divmod(line, STRIDE)
            return f"{lead}{self.files[source]}:{line}" if source < len(self.files) else match[0]

        return _LOG_PLACE.sub(place, log)


def shader_root() -> Path:
    """The folder of the shader pack: in an installed package, or beside the package in a checkout; ShaderError if in neither."""
    package = Path(__file__).resolve().parents[1]
    candidates = (package / "glsl", package.parent / "glsl")
    for folder in candidates:
        if (folder / "stages").is_dir():
            return folder
    raise ShaderError(f"expected the shader pack at {candidates[0]} or {candidates[1]}, found neither; install srbf again")


def resolve(
    path: Path | str, *, defines: Mapping[str, object] | None = None, version: str | None = None, root: Path | None = None
) -> ShaderSource:
    """The shader at `path`, relative to the shader root, with its includes in place.

    `version` replaces the file's own `#version` ("300 es"); `defines` follow it. Raises ShaderError on a missing file, a cycle
    (named as a.glsl -> b.glsl -> a.glsl), a malformed include or define.
    """
    base = shader_root() if root is None else root
    target = base / path
    if not target.is_file():
        raise ShaderError(f"expected a shader at {target}, found none; paths are relative to the shader root {base}")
    return resolve_text(_read(target), Path(path).as_posix(), defines=defines, version=version, root=base, place=target)


def dependence_order(paths: Iterable[str], root: Path | None = None) -> dict[str, str]:
    """The text of the files and of all that they include, by path relative to the root: each once, after what it includes.

    ShaderError as `resolve`.
    """
    base = (shader_root() if root is None else root).resolve()
    texts: dict[str, str] = {}

    def visit(path: Path, name: str, chain: list[str]) -> None:
        if name in texts:
            return
        text = _read(path)
        for i, _, include, _ in _lines(text):
            if include is not None:
                visit(*_included(base, include[1], path, [*chain, name], i), [*chain, name])
        texts[name] = text

    for path in paths:
        visit(*_included(base, path, base / "translation", ["translation"], 1), [])
    return texts


def resolve_text(
    text: str,
    name: str,
    *,
    defines: Mapping[str, object] | None = None,
    version: str | None = None,
    root: Path | None = None,
    place: Path | None = None,
) -> ShaderSource:
    """`resolve` for a shader that is not a file, or not in the pack; logs and errors call it `name`."""
    base = shader_root() if root is None else root
    resolver = _Resolver(base.resolve())
    body = "\n".join(resolver.expand(text, place or base / name, [name]))
    head = [f"#version {version or resolver.version or '330 core'}"]
    head += [f"#define {key} {_literal(key, value)}" for key, value in (defines or {}).items()]
    return ShaderSource("\n".join([*head, "#line 1 0", body, ""]), tuple(resolver.names))


@dataclass
class _Resolver:
    """State of one resolution: files in the order of their source-string numbers, and the top file's #version."""

    root: Path
    names: list[str] = field(default_factory=list)
    seen: set[Path] = field(default_factory=set)
    version: str | None = None

    def expand(self, text: str, place: Path, chain: list[str]) -> Iterator[str]:
        """Lines of one file with its includes in place; `chain` is how it was reached, for errors."""
        number = len(self.names)
        self.names.append(chain[-1])
        self.seen.add(place.resolve())
        for i, line, include, is_version in _lines(text):
            if include is not None:
                yield from self._include(include[1], place, chain, i)
                yield _line(i + 1, number)
            elif is_version:
                yield from self._take_version(line, chain, i)
            else:
                yield line

    def _take_version(self, line: str, chain: list[str], i: int) -> Iterator[str]:
        if len(chain) > 1:
            raise ShaderError(f"{chain[-1]}:{i}: expected #version in the stage alone, found one in an included file; remove it")
        self.version = line.split("version", 1)[1].strip()
        yield ""  # the resolver writes it first, where ES 3.00 wants it

    def _include(self, target: str | None, place: Path, chain: list[str], i: int) -> Iterator[str]:
        path, name = _included(self.root, target, place, chain, i)
        if path not in self.seen:
            yield _line(1, len(self.names))
            yield from self.expand(_read(path), path, [*chain, name])


def _lines(text: str) -> Iterator[tuple[int, str, re.Match[str] | None, bool]]:
    """(number from 1, line, its #include if it has one, whether it is a #version) of each line; comments hold no directives."""
    in_comment = False
    for i, line in enumerate(text.splitlines(), start=1):
        include = None if in_comment else _INCLUDE.match(line)
        yield i, line, include, not in_comment and _VERSION.match(line) is not None
        if include is None:
            in_comment = _ends_in_comment(line, in_comment)


def _included(root: Path, target: str | None, place: Path, chain: list[str], i: int) -> tuple[Path, str]:
    """(path, name in logs) of what line `i` of chain[-1], which lies at `place`, includes; ShaderError where it cannot."""
    if target is None:
        raise ShaderError(f'{chain[-1]}:{i}: expected #include "folder/file.glsl", found no quoted path')
    path = next((p.resolve() for p in (root / target, place.parent / target) if p.is_file()), None)
    if path is None:
        raise ShaderError(f'{chain[-1]}:{i}: cannot find "{target}", neither under {root} nor beside the including file')
    name = path.relative_to(root).as_posix() if path.is_relative_to(root) else str(path)
    if name in chain:
        cycle = " -> ".join([*chain[chain.index(name) :], name])
        raise ShaderError(f"expected includes without a cycle, found {cycle}; break it")
    return path, name


def _line(line: int, source: int) -> str:
    return f"#line {source * STRIDE + line} {source}"


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ShaderError(f"cannot read shader {path}: {error}") from error


def _ends_in_comment(line: str, in_comment: bool) -> bool:
    """Whether a /* comment is open after `line`; // hides what follows it."""
    while line:
        if in_comment:
            _, found, line = line.partition("*/")
            in_comment = not found
        else:
            opened = re.search(r"//|/\*", line)
            if opened is None or opened[0] == "//":
                return False
            line, in_comment = line[opened.end() :], True
    return in_comment


def _literal(name: str, value: object) -> str:
    if not _IDENTIFIER.match(name):
        raise ShaderError(f"expected a define's name as an identifier, found {name!r}")
    if isinstance(value, bool):
        return str(int(value))
    text = str(value)
    if "\n" in text:
        raise ShaderError(f"expected the define {name} on one line, found a line break in {text!r}")
    return text
