"""Run-time checks of annotations by jaxtyping and beartype, with an int welcome where a float is annotated.

A function's checks are made when it is first called, and each test checks the first few calls of each: loops of thousands say no more.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import is_dataclass
from types import FunctionType, SimpleNamespace
from typing import Any, get_type_hints
from unittest import mock

import jaxtyping
from beartype import BeartypeConf, beartype

CALLS = 16  # of each function that a test checks
check = beartype(conf=BeartypeConf(is_pep484_tower=True, violation_type=TypeError))
whole = jaxtyping.jaxtyped
tests = 0  # begun


def install(modules: Sequence[str]) -> None:
    """Have modules that are imported from now on checked: every function, and the fields of dataclasses."""
    mock.patch.object(jaxtyping, "jaxtyped", first_calls).start()  # by this name the hook decorates what is imported
    jaxtyping.install_import_hook(modules, None)


def next_test() -> None:
    """Every function is checked again."""
    global tests
    tests += 1


def resolved(function: FunctionType) -> FunctionType:
    """The function, its annotations no longer text; Any where one is for readers or type checkers alone."""
    for name, text in function.__annotations__.items():
        alone = SimpleNamespace(__annotations__={name: text}, __globals__=function.__globals__)
        try:
            function.__annotations__[name] = get_type_hints(alone, function.__globals__, include_extras=True)[name]
        except (NameError, AttributeError):  # of names that are not imported, of `...` for any shape
            function.__annotations__[name] = Any
    return function


def first_calls(what: Any = None, *, typechecker: Any = None) -> Any:
    """In place of jaxtyping's decorator: one wrapper of beartype for arguments and result, not two."""
    if what is None:
        return first_calls
    if isinstance(what, type):
        if is_dataclass(what):
            checked_class: Any = what
            checked_class.__init__ = first_calls(checked_class.__init__)
        return what
    if not isinstance(what, FunctionType):
        return whole(what, typechecker=check)
    checked: Callable[..., Any] | None = None
    test = calls = 0

    @functools.wraps(what)
    def checks_some(*given: Any, **named: Any) -> Any:
        nonlocal checked, test, calls
        if test != tests:
            test, calls = tests, 0
        if calls == CALLS:
            return what(*given, **named)
        calls += 1
        checked = checked or check(resolved(what))
        with whole("context"):  # in which names of sizes are bound
            return checked(*given, **named)

    return checks_some
