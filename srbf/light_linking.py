"""Light linking: which objects of its scene a light shines on, and which shadow it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool
from srbf.errors import InputError

LINKS = ("receivers", "blockers")  # fields of a light, and keys of its entry
SHOWN = 8  # names in a line


@dataclass(frozen=True)
class Objects:
    """A choice of a scene's objects by name, as a collection of light linking in Blender makes it.

    Parameters
    ----------
    only
        Names of the objects that are chosen; None: all are.
    without
        Names of objects that are not, whatever `only` says.

    Raises
    ------
    InputError
        On names that are no text, or empty.

    Examples
    --------
    >>> from srbf.light_linking import Objects
    >>> Objects(only=("Cup", "Plate")).among(("Table", "Cup")).tolist()
    [False, True]
    >>> Objects(without=("Cup",)).among(("Table", "Cup")).tolist()
    [True, False]
    """

    only: Sequence[str] | None = None  # tuples, once made
    without: Sequence[str] = ()

    def __post_init__(self) -> None:
        if self.only is not None:
            object.__setattr__(self, "only", _checked("only", self.only))
        object.__setattr__(self, "without", _checked("without", self.without))

    @property
    def named(self) -> tuple[str, ...]:
        """All names in it."""
        return (*(self.only or ()), *self.without)

    def among(self, names: Sequence[str]) -> Bool[ndarray, " n"]:
        """(n,) which of the objects with these names are chosen."""
        kept, left = None if self.only is None else frozenset(self.only), frozenset(self.without)
        return np.array([(kept is None or name in kept) and name not in left for name in names], bool)

    def within(self, names: Iterable[str]) -> Objects:
        """The choice of those objects alone that have one of the names."""
        there = frozenset(names)
        only = None if self.only is None else tuple(name for name in self.only if name in there)
        return Objects(only, tuple(name for name in self.without if name in there))

    @staticmethod
    def of_entry(entry: Mapping[str, Any]) -> Objects:
        """From {only, without}, either of which may be missing."""
        only = entry.get("only")
        return Objects(None if only is None else _checked("only", only), _checked("without", entry.get("without", ())))

    def entry(self) -> dict[str, list[str]]:
        """{only, without}, as FRAMES.json has it."""
        return {
            **({} if self.only is None else {"only": list(self.only)}),
            **({"without": list(self.without)} if self.without else {}),
        }


def _checked(field: str, names: Any) -> tuple[str, ...]:
    if isinstance(names, str) or not isinstance(names, Iterable):
        raise InputError(f"expected names of objects in `{field}`, found {names!r}; put them into a list")
    listed = tuple(names)
    for name in listed:
        if not isinstance(name, str) or not name:
            raise InputError(f"expected names of objects in `{field}`, found {name!r}")
    return listed


def choices_of(light: object) -> dict[str, Objects]:
    """The choices that a light makes, by `receivers` and `blockers`."""
    found = {link: getattr(light, link, None) for link in LINKS}
    return {link: choice for link, choice in found.items() if choice is not None}


def refuse_linked(lights: Iterable[object], method: str) -> None:
    """InputError where one of the lights chooses objects, of an asset whose method does not know them."""
    if any(choices_of(light) for light in lights):
        raise InputError(
            f"expected lights without `receivers` and `blockers` for a {method} asset, found one with them; "
            "capture the view with `light_set=gather`"
        )


def require_names(lights: Iterable[object], known: Sequence[str]) -> None:
    """InputError where a light names an object that is not `known`: it lists at most SHOWN that are."""
    there = frozenset(known)
    for light in lights:
        for link, choice in choices_of(light).items():
            missing = next((name for name in choice.named if name not in there), None)
            if missing is not None:
                names = sorted(there)
                listed = ", ".join(repr(name) for name in names[:SHOWN]) + (", …" if len(names) > SHOWN else "")
                raise InputError(f"expected objects of the scene among a light's {link}, found {missing!r}; it has {listed or 'none'}")
