"""What all dialects' writers share: names, calls, samplers passed with their textures, line breaks as in the pack."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from srbf.export.translation import (
    CLOSING,
    PRECISIONS,
    SAMPLED_BY,
    SAMPLERS,
    Constant,
    Function,
    Group,
    Item,
    Node,
    PackFile,
    Parameter,
    Struct,
    Token,
    render_plain,
    split,
    without,
)

WIDTH = 140  # longest line of the pack
SOFTWARE = "SRBF_SAMPLED"  # for software renderers only: engines get the pack without it


@dataclass
class Writer(ABC):
    """Writes parsed GLSL in another dialect: the base class of all dialects, which override the methods below.

    A texture that is filtered here or in a callee is passed with its sampler, `nameSampler`; a texture that is only fetched is not.
    """

    files: list[PackFile]
    types: Mapping[str, str] = field(default_factory=dict)
    words: Mapping[str, str] = field(default_factory=dict)  # functions with other names
    reserved: frozenset[str] = frozenset()

    @cached_property
    def functions(self) -> dict[str, Function]:
        return {function.name: function for file in self.files for function in file.functions}

    @cached_property
    def structs(self) -> frozenset[str]:
        return frozenset(item.name for file in self.files for item in file.items if isinstance(item, Struct))

    @cached_property
    def sampled(self) -> frozenset[tuple[str, str]]:
        """(function, parameter) of every texture that is filtered there or in a callee."""
        found: set[tuple[str, str]] = set()
        for function in self.functions.values():  # callees come first
            names = {parameter.name for parameter in function.parameters if parameter.type in SAMPLERS}
            for callee, arguments in _calls(without(function.body.inside, SOFTWARE)):
                for i, argument in enumerate(arguments):
                    name = render_plain(argument).strip()
                    target = self.functions.get(callee)
                    further = target is not None and i < len(target.parameters) and (callee, target.parameters[i].name) in found
                    if name in names and ((callee in SAMPLED_BY and i == 0) or further):
                        found.add((function.name, name))
        return frozenset(found)

    def file(self, file: PackFile) -> str:
        """One file in this dialect, including its header's `use`."""
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

    @abstractmethod
    def constant(self, item: Constant) -> str:
        """`const type name = value` outside a function."""

    def signature(self, item: Function, indent: int = 0) -> str:
        """`type name(parameters)`, broken into lines of the pack's width."""
        head = f"{self.type(item.type)} {item.name}("
        parameters = [text for parameter in item.parameters for text in self.parameter(item, parameter)]
        return head + wrapped(parameters, len(head), WIDTH - indent) + ")"

    @abstractmethod
    def parameter(self, function: Function, parameter: Parameter) -> list[str]:
        """A parameter as this dialect declares it: a sampled texture becomes two."""

    def body(self, function: Function) -> str:
        return self.expression(without(function.body.inside, SOFTWARE))

    def type(self, name: str) -> str:
        return self.types.get(name, name)

    def name(self, text: str) -> str:
        return text + "_" if text in self.reserved else text

    def expression(self, nodes: Sequence[Node]) -> str:
        """A sequence of nodes, with translated calls."""
        out: list[str] = []
        i = 0
        while i < len(nodes):
            node = nodes[i]
            if isinstance(node, Group):
                out.append(node.opening + self.expression(node.inside) + CLOSING[node.opening])
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
        """A call whose arguments are already in this dialect, with their spaces."""
        target = self.functions.get(name)
        if target is not None:
            pairs = zip(target.parameters, arguments, strict=True)
            arguments = [text + f", {text.strip()}Sampler" * ((name, p.name) in self.sampled) for p, text in pairs]
        return f"{self.types.get(name) or self.words.get(name, name)}({','.join(arguments)})"


def wrapped(parts: Sequence[str], column: int, width: int) -> str:
    """Parts joined by commas, wrapped to lines that start at `column`."""
    lines: list[str] = []
    for part in parts:
        if lines and column + len(lines[-1]) + len(part) + 3 <= width:
            lines[-1] += ", " + part
        else:
            lines.append(part)
    return (",\n" + " " * column).join(lines)


def guarded(file: PackFile, text: str) -> str:
    """A translated file between include guards; its first line names its source."""
    guard = "SRBF_" + re.sub(r"\W", "_", file.path.removesuffix(".glsl")).upper()
    body = text.replace("// SPDX-License-Identifier: MIT\n", "", 1).strip()  # the whole include has it once
    return f"#ifndef {guard}\n#define {guard}\n// from glsl/{file.path}\n{body}\n#endif\n"


def _calls(nodes: Sequence[Node]) -> Iterator[tuple[str, list[list[Node]]]]:
    for i, node in enumerate(nodes):
        if isinstance(node, Group):
            before = nodes[i - 1] if i else None
            if node.opening == "(" and isinstance(before, Token) and before.kind == "name":
                yield before.text, split(node.inside, ",")
            yield from _calls(node.inside)
