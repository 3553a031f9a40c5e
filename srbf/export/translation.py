"""The shader pack taken apart: its small GLSL as functions, constants, structs and comments, and what every dialect's writer shares.

A translation keeps names, comments and lines, so that what ships can be read beside the pack. It knows no list of files: whatever the
pack holds is translated, and GLSL that a dialect has no word for is refused by name.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from srbf.errors import ShaderError
from srbf.gl.includes import shader_root

_TOKEN = re.compile(
    r"(?P<comment>//[^\n]*|/\*.*?\*/)|(?P<directive>^[ \t]*\#[^\n]*)|(?P<space>\s+)"
    r"|(?P<number>(?:\d+\.\d*|\.\d+|\d+)(?:[eE][+-]?\d+)?[uUfF]?)"
    r"|(?P<name>[A-Za-z_]\w*)|(?P<sign>\+\+|--|[-+*/%&|^<>=!]=|&&|\|\||.)",
    re.MULTILINE | re.DOTALL,
)
_CLOSING = {"(": ")", "[": "]", "{": "}"}
PRECISIONS = frozenset({"highp", "mediump", "lowp"})
SAMPLERS = frozenset({"sampler2D", "sampler2DArray"})
SCALARS = frozenset({"void", "float", "int", "uint", "bool"})
VECTORS = frozenset(f"{kind}vec{n}" for kind in ("", "i", "u", "b") for n in (2, 3, 4))
MATRICES = frozenset({"mat2", "mat3", "mat4"})
ASSIGNMENTS = frozenset({"=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^="})
WIDTH = 140  # of a line of the pack
SAMPLED_BY = frozenset({"textureLod", "textureGrad"})
# What no dialect has a word for, or another meaning: the pack does without.
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
    """What stands between a pair of brackets."""

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
    """The files and all that they include, each once, after what it includes; `prepare` (text, path) is asked in that order.

    ShaderError on a missing file or GLSL past the subset.
    """
    base = shader_root() if root is None else root
    found: dict[str, PackFile | None] = {}

    def visit(path: str, origin: str) -> None:
        if path in found:
            return
        found[path] = None
        place = base / path
        if not place.is_file():
            raise ShaderError(f'{origin}: expected "{path}" in the shader pack at {base}, found no such file')
        text = place.read_text(encoding="utf-8")
        for match in re.finditer(r'^\s*#\s*include\s+"([^"]+)"', text, re.MULTILINE):
            visit(match[1], path)
        del found[path]
        found[path] = parse(prepare(text, path), path)  # last, so that the order is that of dependence

    for path in paths:
        visit(path, "translation")
    return [file for file in found.values() if file is not None]


def parse(text: str, path: str) -> PackFile:
    """A file of the pack as items; ShaderError on what is neither function, struct, constant, directive nor comment."""
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


def preprocess(text: str, path: str, known: set[str], define: Callable[[str, str], str]) -> str:
    """A file's text with its conditions taken; a `#define` becomes what `define` (name, value) says, and is `known` from there on.

    Raises ShaderError on `#error`, with its words, and on conditions past `#ifdef`, `#ifndef` and `#elif defined(...)`.
    """
    lines: list[str] = []
    taken: list[str] = []  # of every open condition: yes, not yet, or no more
    for line in text.splitlines():
        match = re.match(r"\s*#\s*(\w+)\s*(.*?)\s*(?://.*)?$", line)
        word, rest = (match[1], match[2]) if match else ("", "")
        if word in ("ifndef", "ifdef"):
            taken.append("yes" if (rest in known) == (word == "ifdef") else "not yet")
        elif word in ("elif", "else"):
            holds = word == "else" or _defined(rest, path) in known
            taken[-1] = "yes" if taken[-1] == "not yet" and holds else "not yet" if taken[-1] == "not yet" else "no more"
        elif word == "endif":
            taken.pop()
        elif any(state != "yes" for state in taken):
            continue
        elif word in ("", "include"):
            lines.append(line)
        elif word == "error":
            raise ShaderError(f"{path}: {rest}")
        else:
            name, _, value = rest.partition(" ")
            if word != "define" or "(" in name or not value:
                raise ShaderError(f"{path}: expected #ifdef, #ifndef, #elif, #error or the #define of a number, found {line.strip()!r}")
            known.add(name)
            lines.append(define(name, value.strip()))
    return "\n".join([*lines, ""])


def _defined(condition: str, path: str) -> str:
    match = re.fullmatch(r"defined\s*\(?\s*(\w+)\s*\)?", condition)
    if match is None:
        raise ShaderError(f"{path}: expected #elif defined(NAME), found #elif {condition}")
    return match[1]


def tokens(text: str) -> list[Token]:
    """GLSL as words; joined again they are the text."""
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
        node.text if isinstance(node, Token) else node.opening + render_plain(node.inside) + _CLOSING[node.opening] for node in nodes
    )


def _grouped(source: Iterator[Token], closing: str | None, path: str) -> Iterator[Node]:
    for token in source:
        if token.kind == "sign" and token.text in _CLOSING:
            yield Group(token.text, tuple(_grouped(source, _CLOSING[token.text], path)))
        elif token.kind == "sign" and token.text in _CLOSING.values():
            if token.text != closing:
                raise ShaderError(f"{path}: expected brackets in pairs, found {token.text!r} where {closing!r} was open")
            return
        elif token.kind == "name" and token.text in UNTRANSLATABLE:
            raise ShaderError(f"{path}: expected GLSL that every dialect has a word for, found {token.text}; write it another way")
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


@dataclass
class Writer:
    """Writes parsed GLSL in another dialect: the base of every dialect, which says its own words in the methods below.

    A texture that is filtered somewhere down the calls travels with its sampler, `nameSampler`; one that is only fetched goes alone.
    """

    files: list[PackFile]
    types: Mapping[str, str] = field(default_factory=dict)
    words: Mapping[str, str] = field(default_factory=dict)  # functions of other names
    reserved: frozenset[str] = frozenset()

    @cached_property
    def functions(self) -> dict[str, Function]:
        return {function.name: function for file in self.files for function in file.functions}

    @cached_property
    def structs(self) -> frozenset[str]:
        return frozenset(item.name for file in self.files for item in file.items if isinstance(item, Struct))

    @cached_property
    def sampled(self) -> frozenset[tuple[str, str]]:
        """(function, parameter) of every texture that is filtered there or further down."""
        found: set[tuple[str, str]] = set()
        for function in self.functions.values():  # callees come first
            names = {parameter.name for parameter in function.parameters if parameter.type in SAMPLERS}
            for callee, arguments in _calls(function.body.inside):
                for i, argument in enumerate(arguments):
                    name = render_plain(argument).strip()
                    target = self.functions.get(callee)
                    further = target is not None and i < len(target.parameters) and (callee, target.parameters[i].name) in found
                    if name in names and ((callee in SAMPLED_BY and i == 0) or further):
                        found.add((function.name, name))
        return frozenset(found)

    def file(self, file: PackFile) -> str:
        """One file in this dialect, its header's `use` in this dialect's own words."""
        text = re.sub(r"\n{3,}", "\n\n", "".join(self.item(item) for item in file.items))
        uses = "\n".join(self.signature(function, 11) for function in file.functions).replace("\n", "\n           ")
        return re.sub(r"(?<=\n   use:    ).+?(?=\n   domain:)", lambda _: uses, text, count=1, flags=re.DOTALL)

    def item(self, item: Item) -> str:
        if isinstance(item, Token):
            return self.directive(item.text) if item.kind == "directive" else item.text
        if isinstance(item, Struct):
            return self.struct(item)
        if isinstance(item, Constant):
            return self.constant(item)
        return self.signature(item) + " {" + self.body(item) + "}"

    def directive(self, text: str) -> str:
        return text

    def struct(self, item: Struct) -> str:
        return f"struct {item.name} {{{self.expression(item.body.inside)}}};"

    def constant(self, item: Constant) -> str:
        raise NotImplementedError

    def signature(self, item: Function, indent: int = 0) -> str:
        """`type name(parameters)`, a line broken where the pack's own limit asks for it."""
        head = f"{self.type(item.type)} {item.name}("
        parameters = [text for parameter in item.parameters for text in self.parameter(item, parameter)]
        return head + wrapped(parameters, len(head), WIDTH - indent) + ")"

    def parameter(self, function: Function, parameter: Parameter) -> list[str]:
        raise NotImplementedError

    def body(self, function: Function) -> str:
        return self.expression(function.body.inside)

    def type(self, name: str) -> str:
        return self.types.get(name, name)

    def name(self, text: str) -> str:
        return text + "_" if text in self.reserved else text

    def expression(self, nodes: Sequence[Node]) -> str:
        """Nodes in a row, calls by their rules."""
        out: list[str] = []
        i = 0
        while i < len(nodes):
            node = nodes[i]
            if isinstance(node, Group):
                out.append(node.opening + self.expression(node.inside) + _CLOSING[node.opening])
            elif node.kind == "name" and not (out and out[-1] == "."):
                following = nodes[i + 1] if i + 1 < len(nodes) else None
                if isinstance(following, Group) and following.opening == "(" and node.text not in ("if", "for", "return"):
                    out.append(self.call(node.text, [self.expression(part) for part in split(following.inside, ",")]))
                    i += 1
                elif node.text in PRECISIONS:
                    i += 1  # with the space after it
                else:
                    out.append(self.type(node.text) if node.text in self.types else self.name(node.text))
            else:
                out.append(node.text)
            i += 1
        return "".join(out)

    def call(self, name: str, arguments: list[str]) -> str:
        """A call whose arguments are already in this dialect, with the spaces that they had."""
        target = self.functions.get(name)
        if target is not None:
            pairs = zip(target.parameters, arguments, strict=True)
            arguments = [text + f", {text.strip()}Sampler" * ((name, p.name) in self.sampled) for p, text in pairs]
        return f"{self.types.get(name) or self.words.get(name, name)}({','.join(arguments)})"


def wrapped(parts: Sequence[str], column: int, width: int) -> str:
    """Parts with commas, on as many lines as it takes, each at `column`."""
    lines: list[str] = []
    for part in parts:
        if lines and column + len(lines[-1]) + len(part) + 3 <= width:
            lines[-1] += ", " + part
        else:
            lines.append(part)
    return (",\n" + " " * column).join(lines)


def guarded(file: PackFile, text: str) -> str:
    """A translated file between include guards, its first line saying where it is from."""
    guard = "SRBF_" + re.sub(r"\W", "_", file.path.removesuffix(".glsl")).upper()
    body = text.replace("// SPDX-License-Identifier: MIT\n", "", 1).strip()  # the whole include says it once
    return f"#ifndef {guard}\n#define {guard}\n// from glsl/{file.path}\n{body}\n#endif\n"


def _calls(nodes: Sequence[Node]) -> Iterator[tuple[str, list[list[Node]]]]:
    for i, node in enumerate(nodes):
        if isinstance(node, Group):
            before = nodes[i - 1] if i else None
            if node.opening == "(" and isinstance(before, Token) and before.kind == "name":
                yield before.text, split(node.inside, ",")
            yield from _calls(node.inside)
