"""What all commands share of the terminal: an error as one line, notes and progress on stderr, JSON alone on stdout."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from srbf.cli.flags import in_flags

if TYPE_CHECKING:
    from rich.console import Console


_parameters: Sequence[Any] = ()  # of the command that runs


def name_flags_of(parameters: Sequence[Any]) -> None:
    """From now on lines name a library's arguments by the flags of the command whose `parameters` these are."""
    global _parameters
    _parameters = parameters


@cache
def stderr() -> Console:
    """Rich's view of stderr, imported with the first line."""
    from rich.console import Console

    return Console(stderr=True, highlight=False, soft_wrap=True)


def fail(message: str, status: int = 1) -> NoReturn:
    """Say it in one line and exit: 1 where the work failed, 2 on wrong usage."""
    stderr().print("srbf: " + " ".join(in_flags(message, _parameters).split()), style="bold red", markup=False)
    raise typer.Exit(status)


def note(message: str) -> None:
    """A line on stderr."""
    stderr().print("srbf: " + in_flags(message, _parameters), markup=False)


def print_json(value: Any) -> None:
    """One JSON object on stdout."""
    sys.stdout.write(json.dumps(value, allow_nan=False) + "\n")


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[..., None]]:
    """A bar with the time left on stderr (nothing where stderr is no terminal); yields update(done, total, text)."""
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=stderr(), transient=True, disable=not stderr().is_terminal) as bar:
        task = bar.add_task(what, total=None)

        def update(done: float, total: float, text: str = what) -> None:
            bar.update(task, completed=done, total=total, description=text)

        yield update


def json_line(value: Any) -> None:
    """One JSON object on stderr, as progress for a program to read."""
    sys.stderr.write(json.dumps(value, allow_nan=False) + "\n")
    sys.stderr.flush()


@contextmanager
def json_progress_lines() -> Iterator[Callable[..., None]]:
    """Progress for a program to read: on stderr, a JSON line each, with the seconds left by the rate so far (null at first)."""
    began: tuple[float, float] | None = None

    def update(done: float, total: float, text: str = "") -> None:
        nonlocal began
        now = time.monotonic()
        if began is None or done < began[1]:
            began = (now, done)
        gained = done - began[1]
        left = None if gained <= 0 else round((total - done) * (now - began[0]) / gained, 1)
        json_line({"done": done, "total": total, "what": text, "seconds_left": left})

    yield update
