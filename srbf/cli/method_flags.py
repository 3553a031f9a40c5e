"""Flags that choose a method and its settings, made of the settings themselves: of `srbf fit`, and of a leave-one-out evaluation."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import MISSING, Field, fields
from itertools import zip_longest
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import typer

from srbf.cli.flags import flags_alone
from srbf.cli.group import Command
from srbf.cli.values import COUNT, Number, Parsed, duration, parse_share
from srbf.fitting.auto_method import DEFAULT_BUDGET
from srbf.fitting.options import AUTO, check_settings
from srbf.registry import all_methods, method_named, method_names


class FitCommand(Command):
    """A command in which `-k`, `--components` and `--clusters` may be bare: then they have the default of the method that they imply."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        bare = {_flag(entry): str(entry.default) for m in all_methods() for entry in _settings(m) if entry.name in m.implied_by}
        bare = {flag: value for flag, value in bare.items() if value.isdecimal()}
        whole: list[str] = []
        for argument, following in zip_longest(args, args[1:], fillvalue=""):
            whole.append(argument)
            if argument in bare and not re.fullmatch(r"[-+]?\d[\w.]*", following):
                whole.append(bare[argument])
        return super().parse_args(ctx, whole)


def with_method_flags(command: Callable[..., None]) -> Callable[..., None]:
    """`command(…, method, settings)` as a command with a flag for every setting of every method: it gets those given, in a dictionary."""
    own = inspect.signature(command, eval_str=True).parameters
    flags = _flags()

    def run(**values: Any) -> None:
        given = {name: values.pop(name) for name in flags if name != "method"}
        settings = {name: value for name, value in given.items() if value is not None}
        with flags_alone():
            check_settings(values["method"], settings)
        command(**values, settings=settings)

    kept = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for name, parameter in own.items() if name not in ("method", "settings")]
    added = [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=hint) for name, hint in flags.items()]
    first = [parameter for parameter in kept if parameter.default is inspect.Parameter.empty]
    run.__signature__ = inspect.Signature([*first, *added, *(p for p in kept if p not in first)])  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in run.__signature__.parameters.values()}  # type: ignore[attr-defined]
    run.__doc__, run.__name__ = command.__doc__, command.__name__
    return run


def _flags() -> dict[str, Any]:
    """Annotations of the flags by the names of their settings, `method` first."""
    names = (*method_names(), AUTO)
    flags: dict[str, Any] = {
        "method": Annotated[
            Literal[names] | None,  # type: ignore[valid-type]
            typer.Option(
                "--method", help="How light transport is compressed; by default what the other flags imply, else auto.", show_default=False
            ),
        ]
    }
    owners: dict[str, list[tuple[str, Field[Any], Any]]] = {}
    for method in all_methods():
        hints = get_type_hints(method)
        for entry in _settings(method):
            owners.setdefault(entry.name, []).append((method.name, entry, hints[entry.name]))
    flags |= {name: _annotation(found) for name, found in owners.items()}
    flags["budget"] = Annotated[
        int | None,
        typer.Option(
            "--budget",
            metavar="BYTES",
            parser=COUNT,
            help=f"auto: per texel, at most ({DEFAULT_BUDGET}). deep-framebuffer: megabytes in all.",
            show_default=False,
        ),
    ]
    flags["psnr"] = Annotated[
        float | None,
        typer.Option(
            "--psnr",
            metavar="DECIBELS",
            parser=Number(),
            help="auto: to reach on held-out lights with the fewest bytes.",
            show_default=False,
        ),
    ]
    flags["error"] = Annotated[
        float | None,
        typer.Option(
            "--error",
            metavar="SHARE",
            parser=Parsed(parse_share),
            help="auto, transfer: relative RMSE on held-out lights that is not to be exceeded, as 5% or .05.",
            show_default=False,
        ),
    ]
    return flags


def _annotation(owners: list[tuple[str, Field[Any], Any]]) -> Any:
    """One flag for the settings of one name: their help with defaults, by method where they differ."""
    entry = owners[0][1]
    texts: dict[str, list[str]] = {}
    for method, own, _ in owners:
        texts.setdefault(f"{own.metadata['help'].rstrip('.')} ({own.default})", []).append(method)
    shared = len(texts) == 1 and len(owners) == len(all_methods())
    help_text = "; ".join(text if shared else f"{', '.join(methods)}: {text}" for text, methods in texts.items()) + "."
    told = tuple(dict.fromkeys(word for _, own, _ in owners for word in own.metadata["words"]))
    hints = {hint for _, _, hint in owners}
    if told:
        whole = any(int in get_args(hint) for hint in hints)
        parser = Number(whole=True, low=1, words=told) if whole else Number(words=told)
        return Annotated[
            Any, typer.Option(_flag(entry), parser=parser, metavar="|".join((*told, "NUMBER")), help=help_text, show_default=False)
        ]
    if hints == {bool}:
        implied = any(entry.name in method_named(method).implied_by for method, _, _ in owners)
        words = _flag(entry) if implied else f"{_flag(entry)}/--no-{_flag(entry).removeprefix('--')}"
        return Annotated[bool | None, typer.Option(words, help=help_text, show_default=False)]
    if entry.metadata["duration"]:
        return Annotated[float | None, typer.Option(_flag(entry), metavar="DURATION", parser=duration, help=help_text, show_default=False)]
    if hints == {str}:
        return Annotated[str | None, typer.Option(_flag(entry), metavar="TEXT", help=help_text, show_default=False)]
    if hints == {int}:
        return Annotated[int | None, typer.Option(_flag(entry), metavar="COUNT", parser=COUNT, help=help_text, show_default=False)]
    choices = tuple(dict.fromkeys(choice for _, _, hint in owners for choice in _choices(hint)))
    return Annotated[Literal[choices] | None, typer.Option(_flag(entry), help=help_text, show_default=False)]  # type: ignore[valid-type]


def _settings(method: Any) -> list[Field[Any]]:
    """The settings that the command line offers."""
    return [entry for entry in fields(method) if "help" in entry.metadata and entry.default is not MISSING]


def _flag(entry: Field[Any]) -> str:
    return entry.metadata["flag"] or f"--{entry.name.replace('_', '-')}"


def _choices(hint: Any) -> list[str]:
    """The strings of a Literal, or of a union of them."""
    if get_origin(hint) is Literal:
        return [str(value) for value in get_args(hint)]
    return [choice for part in get_args(hint) for choice in _choices(part)]
