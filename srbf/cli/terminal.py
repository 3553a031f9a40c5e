"""What all commands share of the terminal: errors as one line and exit 1, notes and progress on stderr, JSON alone on stdout."""

from __future__ import annotations

import json
import os
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from srbf.errors import SrbfError

STDERR = Console(stderr=True, highlight=False, soft_wrap=True)


FORMER_FLAGS = {  # hidden aliases, for one version
    "--hang-after": "--worker-timeout",
    "--keep-lamps": "--keep-scene-lights",
    "--keep-sums": "--keep-accumulation",
    "--lights-a-worker": "--lights-per-worker",
    "--part": "--shard",
    "--texels-per-metre": "--texels-per-meter",
    "--time": "--time-limit",
}


def renamed(argument: str) -> str:
    """The argument with a former flag's present name."""
    flag, equals, value = argument.partition("=")
    return FORMER_FLAGS.get(flag, flag) + equals + value


class Commands(typer.core.TyperGroup):
    """A command group that turns the project's errors into one line on stderr and exit 1; wrong usage exits 2 as click has it."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        return super().parse_args(ctx, [renamed(argument) for argument in args])

    def invoke(self, ctx: Any) -> Any:
        warnings.showwarning = lambda message, *_args, **_kwargs: note(str(message))
        try:
            return super().invoke(ctx)
        except SrbfError as error:
            fail(str(error))
        except OSError as error:
            if isinstance(error, BrokenPipeError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
                raise typer.Exit(1) from None
            where = f" at {error.filename}" if error.filename else ""
            fail(f"the system refused{where}: {error.strerror or error}; free space, or choose a place that can be read and written")
        except MemoryError:
            fail("expected enough memory, found none left; use fewer maps or smaller images")
        except KeyboardInterrupt:
            fail("stopped; the same command goes on with a bake, other outputs were not written")


def fail(message: str) -> None:
    """Say it in one line, exit 1."""
    STDERR.print("srbf: " + " ".join(message.split()), style="bold red", markup=False)
    raise typer.Exit(1)


def note(message: str) -> None:
    """A line on stderr."""
    STDERR.print("srbf: " + message, markup=False)


def print_json(value: Any) -> None:
    """One JSON object on stdout."""
    sys.stdout.write(json.dumps(value, allow_nan=False) + "\n")


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[..., None]]:
    """A bar with the time left on stderr (nothing where stderr is no terminal); yields update(done, total, text)."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=STDERR, transient=True, disable=not STDERR.is_terminal) as bar:
        task = bar.add_task(what, total=None)

        def update(done: float, total: float, text: str = what) -> None:
            bar.update(task, completed=done, total=total, description=text)

        yield update


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
        sys.stderr.write(json.dumps({"done": done, "total": total, "what": text, "seconds_left": left}) + "\n")
        sys.stderr.flush()

    yield update
