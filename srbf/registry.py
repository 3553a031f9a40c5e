"""Finds methods by name: a module of `srbf/methods/` that defines METHOD is one, and nothing else lists them.

Below `srbf.asset`, so that an asset can ask for the reader of its own tables; modules are imported when they are asked for.
"""

from __future__ import annotations

import functools
import pkgutil
from importlib import import_module, util
from typing import TYPE_CHECKING

from srbf.errors import InputError

if TYPE_CHECKING:
    from srbf.methods.protocol import Method

PACKAGE = "srbf.methods"


@functools.cache
def method_named(name: str) -> type[Method]:
    """The class of the method `name`, of the module of the same stem; InputError on an unknown one."""
    stem = name.replace("-", "_")
    if stem.isidentifier() and util.find_spec(f"{PACKAGE}.{stem}") is not None:
        found = getattr(import_module(f"{PACKAGE}.{stem}"), "METHOD", None)
        if found is not None and found.name == name:
            return found
    raise InputError(f"expected a method of {', '.join(method_names())}, found {name!r}")


@functools.cache
def all_methods() -> tuple[type[Method], ...]:
    """The classes of all methods, the simplest first."""
    modules = [import_module(f"{PACKAGE}.{module.name}") for module in pkgutil.iter_modules(import_module(PACKAGE).__path__)]
    return tuple(sorted((module.METHOD for module in modules if hasattr(module, "METHOD")), key=lambda method: method.order))


def method_names() -> tuple[str, ...]:
    """The names of all methods."""
    return tuple(method.name for method in all_methods())
