"""Evaluates the pack's preprocessor conditions for an asset's counts: for dialects without a preprocessor, and for short texts."""

from __future__ import annotations

import re
from collections.abc import Callable

from srbf.errors import ShaderError


def preprocess(text: str, path: str, known: set[str], define: Callable[[str, str], str]) -> str:
    """A file's text with evaluated conditions; a `#define` becomes the result of `define` (name, value), and is `known` from there on.

    Raises ShaderError on `#error`, with its message, and on conditions other than `#ifdef`, `#ifndef` and `#elif defined(...)`.
    """
    lines: list[str] = []
    taken: list[str] = []  # state of every open condition: yes, not yet, or no more
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
