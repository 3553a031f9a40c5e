"""The group of commands, each imported when it is called, and the commands: flags in panels, errors as one line that names flags.

Exit 2 is wrong usage: a flag that cannot be parsed, or flags that exclude each other. Exit 1 is work that failed.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator, Mapping
from importlib import import_module
from itertools import takewhile
from typing import Any

import typer
import typer.core

from srbf.cli.flags import called, present
from srbf.cli.terminal import fail, name_flags_of, note
from srbf.errors import SrbfError

UsageError: Any = typer.BadParameter.__base__  # click's, or that of typer's own copy


class Command(typer.core.TyperCommand):
    """A command that takes former flags too and lists its flags by `rich_help_panel`, in plain text."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        name_flags_of(self.params)
        flags = {flag for parameter in self.params for flag in (*parameter.opts, *parameter.secondary_opts)}
        options = list(takewhile(lambda argument: argument != "--", args))
        return super().parse_args(ctx, [present(argument, flags) for argument in options] + args[len(options) :])

    def format_options(self, ctx: Any, formatter: Any) -> None:
        panels: dict[str, list[tuple[str, str]]] = {"Arguments": [], "Options": []}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None:
                if parameter.param_type_name == "argument":
                    panels["Arguments"].append((record[0].partition(" ")[0], record[1]))  # its word without its type
                else:
                    panels.setdefault(getattr(parameter, "rich_help_panel", None) or "Options", []).append(record)
        for name, records in panels.items():
            if records:
                with formatter.section(name):
                    formatter.write_dl(records)


class CommandTable(Mapping[str, Any]):
    """Commands by name; `functions` says where each is, `module:function`, to import once it is asked for.

    A module may have a subclass of Command of its own as `COMMAND`.
    """

    def __init__(self, functions: Mapping[str, str]) -> None:
        self._functions = functions
        self._loaded: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._loaded:
            place, _, function = self._functions[name].partition(":")
            module = import_module(place)
            alone = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
            alone.command(name, cls=getattr(module, "COMMAND", Command))(getattr(module, function))
            self._loaded[name] = typer.main.get_command(alone)
        return self._loaded[name]

    def __contains__(self, name: object) -> bool:
        return name in self._functions

    def __iter__(self) -> Iterator[str]:
        return iter(self._functions)

    def __len__(self) -> int:
        return len(self._functions)


class Commands(typer.core.TyperGroup):
    """The commands of `FUNCTIONS`, with `SUMMARIES` for the list of them: subclasses set both."""

    FUNCTIONS: Mapping[str, str]
    SUMMARIES: Mapping[str, str]

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands: Any = CommandTable(self.FUNCTIONS)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(self.SUMMARIES.items()))

    def get_params(self, ctx: Any) -> list[Any]:
        """None where a command comes first: typer would import pydantic to see that no flag was given."""
        return [] if ctx.meta.get("srbf.command first") else super().get_params(ctx)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        bare = not args
        ctx.meta["srbf.command first"] = not bare and not args[0].startswith("-")
        try:
            return super().parse_args(ctx, args)
        except UsageError as error:
            if not bare:
                _refuse(error, ctx)
            raise  # no arguments at all: its text is the help

    def invoke(self, ctx: Any) -> Any:
        warnings.showwarning = lambda message, *_args, **_kwargs: note(str(message))
        try:
            return super().invoke(ctx)
        except UsageError as error:
            _refuse(error, ctx)
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
            fail("stopped; the same command resumes a bake, other outputs were not written")


def _refuse(error: Any, group: Any) -> None:
    """Wrong usage as one line, exit 2. `group` is the context of the commands."""
    ctx = error.ctx or group
    message = error.message.removeprefix("Value error, ")
    parameter = getattr(error, "param", None)
    if parameter is not None:
        message = f"{called(parameter)}: {message}" if message else f"expected {called(parameter)}, found none"
    elif not isinstance(error, typer.BadParameter):
        message = error.format_message()
    message = message.strip().rstrip(".")
    fail(message if ";" in message else f"{message}; see {ctx.command_path} --help", 2)
