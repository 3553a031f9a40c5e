"""Flags by name: the former ones, for one version, and those that the library's arguments have on the command line."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import typer

from srbf.errors import InputError

FORMER_FLAGS = {  # hidden aliases, for one version
    "--a0": "--reference-distance",
    "--hang-after": "--worker-timeout",
    "--keep": "--reduce-to",
    "--keep-lamps": "--keep-scene-lights",  # words: ok
    "--keep-sums": "--keep-accumulation",
    "--levels": "--mip-levels",
    "--light-box": "--light-bounds",
    "--lights-a-worker": "--lights-per-worker",
    "--no-shadow": "--no-cast-shadow",
    "--part": "--shard",
    "--scalars": "--components",
    "--texels-per-metre": "--texels-per-meter",  # words: ok
    "--time": "--time-limit",
}
SHORT = {"k": "-k"}  # flags of one letter
OTHERWISE_NAMED = {  # arguments of the library whose flag has another name
    "a0": "reference_distance",
    "count": "reduce_to",
    "levels": "mip_levels",
    "no_shadow": "no_cast_shadow",
    "seconds": "time_limit",
}
ARGUMENT = re.compile(r"`(\w+)(?:=([^`]*))?`")  # `name`, or `name=value` as a call in Python has it
QUOTED = re.compile(r"[\"']([\w.:/-]+)[\"']")  # a value that a shell takes without its quotes


def present(word: str, flags: Collection[str]) -> str:
    """A word of a command line, a former flag by its present name where that is one of the command's `flags`."""
    flag, equals, value = word.partition("=")
    now = FORMER_FLAGS.get(flag)
    return word if now not in flags else f"{now}{equals}{value}"


def in_flags(message: str, parameters: Sequence[Any]) -> str:
    """A message of the library, its arguments in backticks replaced by the flags of the command whose `parameters` these are.

    `name` and `name=value` become --name and --name value, `name=True` --name; what the command has no flag for is one of another command.
    """
    by_name = {parameter.name: parameter for parameter in parameters}

    def flag(found: re.Match[str]) -> str:
        name, value = found[1], found[2]
        known = OTHERWISE_NAMED.get(name, name)
        parameter = by_name.get(known) or by_name.get(name)
        word = SHORT.get(known, f"--{known.replace('_', '-')}") if parameter is None else called(parameter)
        return word if value in (None, "True") else f"{word} " + QUOTED.sub(r"\1", value)

    return ARGUMENT.sub(flag, message)


def called(parameter: Any) -> str:
    """What a user writes for it: an option's first flag, an argument's word."""
    if parameter.param_type_name == "option":
        return str(parameter.opts[0])
    return str(parameter.metavar or parameter.name.upper())


@contextmanager
def flags_alone() -> Iterator[None]:
    """Where nothing but flags is looked at: what the library refuses there is wrong usage."""
    try:
        yield
    except InputError as error:
        raise typer.BadParameter(str(error)) from error
