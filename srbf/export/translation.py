"""Parses the shader pack: its GLSL subset as functions, constants, structs and comments, for the dialects' writers.

A translation keeps names, comments and lines, so that it can be read beside the pack. There is no list of files: everything in the
pack is translated, and GLSL without an equivalent in a dialect is refused by name.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from srbf.errors import ShaderError
from srbf.gl.includes import dependence_order, shader_root

_TOKEN = re.compile(
    r"(?P<comment>//[^\n]*|/\*.*?\*/)|(?P<directive>^[ \t]*\#[^\n]*)|(?P<space>\s+)"
    r"|(?P<number>(?:\d+\.\d*|\.\d+|\d+)(?:[eE][+-]?\d+)?[uUfF]?)"
    r"|(?P<name>[A-Za-z_]\w*)|(?P<sign>\+\+|--|[-+*/%&|^<>=!]=|&&|\|\||.)",
    re.MULTILINE | re.DOTALL,
)
CLOSING = {"(": ")", "[": "]", "{": "}"}
PRECISIONS = frozenset({"highp", "mediump", "lowp"})
SAMPLERS = frozenset({"sampler2D", "sampler2DArray"})
SCALARS = frozenset({"void", "float", "int", "uint", "bool"})
VECTORS = frozenset(f"{kind}vec{n}" for kind in ("", "i", "u", "b") for n in (2, 3, 4))
MATRICES = frozenset({"mat2", "mat3", "mat4"})
ASSIGNMENTS = frozenset({"=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^="})
SAMPLED_BY = frozenset({"textureLod", "textureGrad"})
# Without an equivalent in some dialect, or with another meaning there: the pack does not use them.
UNTRANSLATABLE = frozenset(
    {"mod", "texture", "textureGather", "textureOffset", "dFdx", "dFdy", "discard", "while", "do", "switch", "uniform", "varying"}
    | {"lessThan", "lessThanEqual", "greaterThan", "greaterThanEqual", "equal", "notEqual", "not", "inout"}
)


@dataclass(frozen=True)
class Token:
    """One word of GLSL: comment, directive, space, number, name or sign."""

    kind: str
    text: str


@dataclass(frozen=True)
class Group:
    """The content of a pair of brackets."""

    opening: str
    inside: tuple[Node, ...]


Node = Token | Group


@dataclass(frozen=True)
class Parameter:
    """A function's parameter; `size` is the text between an array's brackets, `out` whether the function writes it."""

    type: str
    name: str
    size: str | None = None
    out: bool = False


@dataclass(frozen=True)
class Function:
    """A function's signature and body."""

    type: str
    name: str
    parameters: tuple[Parameter, ...]
    body: Group


@dataclass(frozen=True)
class Struct:
    """A struct; its members keep their comments."""

    name: str
    body: Group


@dataclass(frozen=True)
class Constant:
    """`const type name = value;` outside a function."""

    type: str
    name: str
    value: tuple[Node, ...]


Item = Function | Struct | Constant | Token


@dataclass(frozen=True)
class PackFile:
    """One file of the pack: its path there, and its items in order; includes are in `pack_files`' order instead."""

    path: str
    items: tuple[Item, ...]

    @property
    def functions(self) -> list[Function]:
        return [item for item in self.items if isinstance(item, Function)]


def library_paths(root: Path | None = None) -> list[str]:
    """Every file of functions in the pack: all of *.glsl."""
    base = shader_root() if root is None else root
    return sorted(path.relative_to(base).as_posix() for path in base.rglob("*.glsl"))


def pack_files(
    paths: Iterable[str], root: Path | None = None, prepare: Callable[[str, str], str] = lambda text, path: text
) -> list[PackFile]:
    """The files and all that they include, each once, after what it includes; `prepare` (text, path) is called in that order.

    ShaderError on a missing file, a cycle, or GLSL outside the subset.
    """
    return [parse(prepare(text, path), path) for path, text in dependence_order(paths, root).items()]


def without(nodes: Sequence[Node], name: str) -> list[Node]:
    """Nodes of a function's body as if `name` were never defined."""
    kept: list[Node] = []
    branch = ""
    for node in nodes:
        words = node.text.split()[:2] if isinstance(node, Token) and node.kind == "directive" else []
        if words == ["#ifdef", name]:
            branch = "#ifdef"
        elif branch and words[:1] in (["#else"], ["#endif"]):
            branch = "#else" if words == ["#else"] else ""
        elif branch != "#ifdef":
            kept.append(node)
    return kept


def parse(text: str, path: str) -> PackFile:
    """A file of the pack as items; ShaderError on anything but functions, structs, constants, directives and comments."""
    nodes = list(_grouped(iter(tokens(text)), None, path))
    items: list[Item] = []
    i = 0
    while i < len(nodes):
        node = nodes[i]
        if isinstance(node, Token) and node.kind in ("space", "comment", "directive"):
            if not (node.kind == "directive" and re.match(r"\s*#\s*include\b", node.text)):
                items.append(node)
            i += 1
            continue
        end = next((j for j in range(i, len(nodes)) if _ends_item(nodes, j)), None)
        if end is None:
            raise ShaderError(f"{path}: expected a function, a struct or a constant, found {render_plain(nodes[i:])[:60]!r}")
        items.append(_item(nodes[i : end + 1], path))
        i = end + 1
    return PackFile(path, tuple(items))


def tokens(text: str) -> list[Token]:
    """GLSL as tokens; joined, they give the text."""
    return [Token(str(match.lastgroup), match[0]) for match in _TOKEN.finditer(text)]


def significant(nodes: Sequence[Node]) -> list[Node]:
    """Without spaces, comments and directives."""
    return [node for node in nodes if isinstance(node, Group) or node.kind not in ("space", "comment", "directive")]


def split(nodes: Sequence[Node], sign: str) -> list[list[Node]]:
    """Parts between top-level signs; an empty sequence has none."""
    parts: list[list[Node]] = [[]]
    for node in nodes:
        if is_sign(node, sign):
            parts.append([])
        else:
            parts[-1].append(node)
    return parts if significant(nodes) else []


def is_sign(node: Node, *texts: str) -> bool:
    return isinstance(node, Token) and node.kind == "sign" and node.text in texts


def is_group(node: Node | None, opening: str) -> bool:
    return isinstance(node, Group) and node.opening == opening


def render_plain(nodes: Sequence[Node]) -> str:
    """The GLSL that the nodes were read from."""
    return "".join(
        node.text if isinstance(node, Token) else node.opening + render_plain(node.inside) + CLOSING[node.opening] for node in nodes
    )


def _grouped(source: Iterator[Token], closing: str | None, path: str) -> Iterator[Node]:
    for token in source:
        if token.kind == "sign" and token.text in CLOSING:
            yield Group(token.text, tuple(_grouped(source, CLOSING[token.text], path)))
        elif token.kind == "sign" and token.text in CLOSING.values():
            if token.text != closing:
                raise ShaderError(f"{path}: expected brackets in pairs, found {token.text!r} where {closing!r} was open")
            return
        elif token.kind == "name" and token.text in UNTRANSLATABLE:
            raise ShaderError(f"{path}: expected GLSL with an equivalent in every dialect, found {token.text}; write it another way")
        else:
            yield token
    if closing is not None:
        raise ShaderError(f"{path}: expected {closing!r}, found the end of the file")


def _ends_item(nodes: Sequence[Node], j: int) -> bool:
    if is_sign(nodes[j], ";"):
        return True
    before = significant(nodes[:j])
    return is_group(nodes[j], "{") and bool(before) and is_group(before[-1], "(")


def _item(nodes: Sequence[Node], path: str) -> Item:
    words = [node for node in significant(nodes) if not (isinstance(node, Token) and node.text in PRECISIONS)]
    texts = [node.text if isinstance(node, Token) else node.opening for node in words]
    body = words[-1]
    if len(words) == 4 and texts[2] == "(" and isinstance(body, Group) and isinstance(words[2], Group):
        parameters = tuple(_parameter(part, path) for part in split(words[2].inside, ",") if render_plain(part).strip() != "void")
        return Function(texts[0], texts[1], parameters, body)
    if len(words) == 4 and texts[0] == "struct" and isinstance(words[2], Group):
        return Struct(texts[1], words[2])
    if texts[0] == "const" and len(texts) > 4 and texts[3] == "=":
        return Constant(texts[1], texts[2], tuple(words[4:-1]))
    raise ShaderError(f"{path}: expected a function, a struct or a constant, found {render_plain(nodes)[:60]!r}")


def _parameter(nodes: Sequence[Node], path: str) -> Parameter:
    words = [node for node in significant(nodes) if not (isinstance(node, Token) and node.text in (*PRECISIONS, "in", "const"))]
    out = isinstance(words[0], Token) and words[0].text == "out"
    words = words[out:]
    if not (len(words) in (2, 3) and isinstance(words[0], Token) and isinstance(words[1], Token)):
        raise ShaderError(f"{path}: expected a parameter as type and name, found {render_plain(nodes).strip()!r}")
    size = render_plain(words[2].inside) if len(words) == 3 and isinstance(words[2], Group) else None
    return Parameter(words[0].text, words[1].text, size, out)
