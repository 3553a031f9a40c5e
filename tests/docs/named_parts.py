"""What a command names, looked at without running it: files, npm's scripts and packages, pip's extras, the flags of our own scripts."""

from __future__ import annotations

import argparse
import json
import re
import runpy
import shutil
import sys
import tomllib
from pathlib import Path

import pytest
from classes import variants
from documented import ROOT, Command
from npm_package import PATH

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
PACKAGE = json.loads((ROOT / "web" / "package.json").read_text())


class Accepted(Exception):
    """A script's parser has taken its arguments."""


def wrong_in(command: Command) -> str | None:
    """What a command names that is not there, or None."""
    program, *words = command.words
    looked_at = {"pip": _pip, "npm": _npm, "python": _python, "sh": _paths, "cd": _paths, "pytest": _paths}
    if program in looked_at:
        return looked_at[program](words, command)
    if program in ("ruff", "mypy", "lint-imports"):
        return None if shutil.which(program, path=PATH) else f"{program} is not installed"
    return None


def _paths(words: list[str], command: Command) -> str | None:
    """Words that can only be paths are those of files or folders of ours."""
    missing = [word for word in words if ("/" in word or command.words[0] == "cd") and not (ROOT / word).exists() and ".venv" not in word]
    return f"{', '.join(missing)} is not there" if missing else None


def _pip(words: list[str], command: Command) -> str | None:
    extras = PROJECT["optional-dependencies"]
    ours = {re.split(r"[^\w.-]", line)[0] for lines in extras.values() for line in lines} | {"srbf", ".", "pip", "blender_bake"}
    for word in words[1:]:
        found = re.fullmatch(r"([\w.-]+)(?:\[([\w,]+)\])?", word)
        if word.startswith("-"):
            continue
        if found is None or found[1] not in ours:
            return f"{word} is in no extra of pyproject.toml"
        unknown = set(filter(None, (found[2] or "").split(","))) - set(extras)
        if unknown:
            return f"pyproject.toml has no extra {', '.join(unknown)}"
    return None


def _npm(words: list[str], command: Command) -> str | None:
    words = [word for word in words if not word.startswith("-")]
    if words[0] in ("run", "test"):
        return None if words[-1] in PACKAGE["scripts"] else f"web/package.json has no script {words[-1]}"
    if words[0] == "install":
        tested = {f"./{PACKAGE['name']}-{PACKAGE['version']}.tgz", *PACKAGE["devDependencies"]}
        unknown = set(words[1:]) - tested
        return f"web/ is not tested with {', '.join(unknown)}" if unknown else None
    return None


def _python(words: list[str], command: Command) -> str | None:
    """Whether the script's own parser takes the arguments; the script goes no further."""
    if not words[0].endswith(".py"):
        return None
    script = ROOT / words[0]
    if not script.is_file():
        return f"{words[0]} is not there"
    (words,) = variants(command)
    parse = argparse.ArgumentParser.parse_args

    def parse_alone(parser: argparse.ArgumentParser, *_given: object) -> None:
        parse(parser, words[1:])
        raise Accepted

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(argparse.ArgumentParser, "parse_args", parse_alone)
        patch.setattr(sys, "argv", [str(script), *words[1:]])
        patch.setattr(sys, "path", [str(script.parent), *sys.path])
        for name, module in list(sys.modules.items()):  # the script's neighbors, loaded by another script, as in a new process
            if Path(getattr(module, "__file__", None) or "").parent == script.parent:
                patch.delitem(sys.modules, name)
        try:
            runpy.run_path(str(script), run_name="__main__")
        except Accepted:
            return None
        except SystemExit as end:
            return None if "--help" in words and not end.code else f"its parser ends with {end.code}"
    return "it has no parser"
