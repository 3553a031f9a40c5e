"""What each documented command is: run here, run by another test, only mentioned, or read and not run; a command that is nothing fails."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from itertools import chain
from typing import Any, Literal

import typer
from documented import ROOT, Command
from tables import ELSEWHERE, NOT_RUN, OTHERS_FLAGS, SHORTER, STAND_INS, STAND_INS_OF

from srbf.cli import app

Class = Literal["run", "elsewhere", "mention", "not run", "checked"]
CLICK = sys.modules[typer.BadParameter.__module__]  # click's errors, or those of typer's own copy
COMMANDS: dict[str, Any] = typer.main.get_group(app).commands
CHECKED = ("pip", "pytest", "cd", "sh", "touch", "ruff", "mypy", "lint-imports")  # by looking at what they name
RUN = ("srbf", "python", "openjd", "npm pack", "npm run example")


class NobodyRunsIt(AssertionError):
    """A documented command without a class; says where it stands."""

    def __init__(self, command: Command, why: str) -> None:
        super().__init__(f"{command}\n  {why}")


@cache
def steps(command: Command) -> list[Command]:
    """What a shell does for it one after the other; a target of make is as good as its recipe."""
    found = []
    for part in re.split(r"\s+&&\s+", command.text):
        words = command.saying(part).words
        found += chain.from_iterable(map(steps, recipe(command.saying(part)))) if words[0] == "make" else [command.saying(part)]
    return [step.saying(f"python {step.text}") if step.words[0].endswith(".py") else step for step in found]


@cache
def recipe(command: Command) -> list[Command]:
    """What make would run, all that it has to set up first included."""
    alone = {name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFLAGS"))}  # of the make that tests us
    asked = ["make", "-n", "--no-print-directory", *command.words[1:]]
    done = subprocess.run(asked, cwd=ROOT, env=alone, capture_output=True, text=True, check=False)
    if done.returncode:
        raise NobodyRunsIt(command, f"make refuses it: {done.stderr.strip()}")
    return [command.saying(line) for line in done.stdout.splitlines() if not line.startswith("make")]


def matching(command: Command, table: dict[str, str]) -> str | None:
    """The entry of a table for a command: one that says all of its words, or, with a star, some of them."""
    words = _plain(command)
    for key, value in table.items():
        named = key.split()
        if (set(named[:-1]) <= set(words) and named[0] == words[0]) if named[-1] == "*" else named == words:
            return value
    return None


def _plain(command: Command) -> list[str]:
    return [word.partition("=")[0] if word.startswith("--") else word for word in command.words]


@cache
def class_of(command: Command, script: bool) -> Class:
    """The class of one step; in a script each is a whole command, elsewhere it may be a mention of one. NobodyRunsIt where it has none."""
    program, *rest = command.words
    if program == "srbf" and rest[0] not in (*COMMANDS, "--version", "--help"):
        raise NobodyRunsIt(command, f"srbf has no command {rest[0]}")
    if program == "srbf" and rest[0] in COMMANDS:
        whole = [_is_whole(command, words) for words in variants(command)]
        if not all(whole):
            if script:
                raise NobodyRunsIt(command, "a script's command lacks an argument or an option that it cannot be run without")
            return "mention"
    if matching(command, ELSEWHERE):
        return "elsewhere"
    if matching(command, NOT_RUN):
        return "not run"
    if program in CHECKED:
        return "checked"
    name = " ".join(_plain(command))
    if any(name == one or name.startswith(f"{one} ") for one in RUN) and not (program == "python" and not rest[0].endswith(".py")):
        return "run"
    raise NobodyRunsIt(command, "nobody runs this: name the test that does in tests/docs/tables.py, or have tests/docs/workplace.py run it")


def _is_whole(command: Command, words: list[str]) -> bool:
    """Whether `srbf WORDS` could be run; NobodyRunsIt where an option or a value of it is none."""
    try:
        COMMANDS[words[0]].make_context(words[0], words[1:])
    except (CLICK.MissingParameter, CLICK.BadOptionUsage):
        return False
    except CLICK.UsageError as error:
        raise NobodyRunsIt(command, f"srbf {words[0]} refuses it: {error.format_message()}") from None
    except typer.Exit:
        pass
    return True


def asked_for(command: Command) -> str:
    """What a command runs, except where it writes: two of the same need one run."""
    if command.words[0] != "srbf" or command.words[1] not in COMMANDS:
        return command.text
    parsed = [COMMANDS[words[0]].make_context(words[0], words[1:]).params for words in variants(command)]
    return f"{command.words[1]} {[{name: value for name, value in one.items() if name != 'output'} for one in parsed]}"


def fits_some_command(flag: Command) -> bool:
    """Whether a span that begins with a flag could stand after one of our commands, or its flags are those of a script of ours."""
    if flag.words[0] in OTHERS_FLAGS:
        return True
    for name in COMMANDS:
        try:
            for words in variants(flag.saying(f"srbf {name} {flag.text}")):
                _is_whole(flag, words)
        except NobodyRunsIt:
            continue
        return True
    return all(f'"{word.partition("=")[0]}"' in _scripts() for word in flag.words if word.startswith("-"))


@cache
def _scripts() -> str:
    """All scripts that the documentation may call, as one text."""
    return "\n".join(
        path.read_text(encoding="utf-8") for part in ("benchmarks", "scripts", "data/scenes") for path in (ROOT / part).rglob("*.py")
    )


def variants(command: Command) -> list[list[str]]:
    """The arguments of a command with stand-ins for its placeholders, once for each of its choices, and what makes it short."""
    program, *words = command.words
    table = STAND_INS | STAND_INS_OF.get(words[0] if words else "", {})
    options = [list(_choices(word)) if program == "srbf" else [word] for word in words]
    found = []
    for i in range(max(map(len, options), default=1)):
        chosen = (option[i % len(option)] for option in options)
        found.append([part for word in chosen if word for part in _stood_in(word, table)])
    return found


def shortened(command: Command) -> list[str]:
    """What to append to a command that takes long."""
    return (matching(command, SHORTER) or "").split()


def _choices(word: str) -> Iterator[str]:
    """A|B is A and B, A[B] is A and AB, A... or A… is A."""
    for part in word.split("|"):
        bracket = re.fullmatch(r"([^\[]*)\[(.*)\](.*)", part)
        yield from (part,) if bracket is None else (bracket[1] + bracket[3], "".join(bracket.groups()))


def _stood_in(word: str, table: dict[str, str]) -> list[str]:
    word = re.sub(r"(\.\.\.|…)$", "", word)
    if word in table:
        return table[word].split()
    return [re.sub(r"(?<![A-Za-z_.])[A-Z]+(?![A-Za-z_.])", lambda found: table.get(found[0], found[0]), word)]
