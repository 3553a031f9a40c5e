# SPDX-License-Identifier: GPL-3.0-or-later
"""`blender -b x.blend --command srbf …`: the library's command line; it bakes the open file with this Blender by default."""

from __future__ import annotations

import os
import signal
import sys
from typing import Any

import bpy

from .process import no_extensions


def run(arguments: list[str]) -> int:
    """Run `srbf` with these arguments; its exit status."""
    try:
        from typer.main import get_command

        from srbf.cli import app
    except ImportError as error:
        print(f"srbf: expected the library beside this extension, found {error}; install the extension's zip again", file=sys.stderr)  # noqa: T201
        return 1
    signal.signal(signal.SIGINT, signal.default_int_handler)  # Blender's own handler would only end a render
    commands = get_command(app)
    full = completed(arguments, commands, bpy.data.filepath, bpy.app.binary_path)
    with no_extensions() as folder:
        os.environ["BLENDER_USER_EXTENSIONS"] = folder
        try:
            commands.main(args=full, prog_name="srbf")
        except SystemExit as ended:
            return ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    return 0


def completed(arguments: list[str], commands: Any, opened: str, blender: str) -> list[str]:
    """The arguments completed by Blender: the open file where `bake` names no scene, this Blender where none is named.

    Invalid arguments are left for the command line to refuse.
    """
    name, given = (arguments or [""])[0], arguments[1:]
    command = commands.commands.get(name)
    if command is None or "--help" in given:
        return arguments
    options = [parameter for parameter in command.params if parameter.param_type_name == "option"]
    added = []
    if name == "bake" and opened and not _names_a_file(given, {flag for option in options if not option.is_flag for flag in option.opts}):
        added.append(opened)
    takes_blender = any("--blender" in option.opts for option in options)
    if blender and takes_blender and not any(word.split("=")[0] == "--blender" for word in given):
        added += ["--blender", blender]
    return [name, *added, *given]


def _names_a_file(given: list[str], with_value: set[str]) -> bool:
    """Whether any word is neither an option nor an option's value."""
    words = iter(given)
    for word in words:
        if word == "--":
            return next(words, None) is not None
        if word in with_value:
            next(words, None)
        elif not word.startswith("-"):
            return True
    return False
