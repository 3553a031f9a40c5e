"""Values of flags as text: numbers in their range, words in place of a number, sizes, durations. Anything else is wrong usage, exit 2."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar

import typer

from srbf.errors import InputError

T = TypeVar("T")


@dataclass(frozen=True)
class Number:
    """A number of at least `low` (above it where `above`) and at most `high`, or one of `words`; a whole one where `whole`."""

    whole: bool = False
    low: float = -math.inf
    high: float = math.inf
    above: bool = False
    words: tuple[str, ...] = ()

    __name__ = "number"  # typer asks a parser for one

    def __call__(self, text: Any) -> Any:
        """An int or float, or the word; defaults that are numbers already stay."""
        if not isinstance(text, str) or text in self.words:
            return text
        try:
            number = int(text) if self.whole else float(text)
        except ValueError:
            number = math.nan
        if math.isnan(number) or not self.low <= number <= self.high or (self.above and number == self.low):
            raise typer.BadParameter(f"expected {self}, found {text!r}")
        return number

    def __str__(self) -> str:
        words = [*self.words, "a whole number" if self.whole else "a number"]
        text = f"{', '.join(words[:-1])} or {words[-1]}" if len(words) > 1 else words[0]
        if self.low > -math.inf and self.high < math.inf:
            return f"{text} from {self.low:g} to {self.high:g}"
        if self.high < math.inf:
            return f"{text} of at most {self.high:g}"
        if self.low > -math.inf:
            return f"{text} above {self.low:g}" if self.above else f"{text} of {self.low:g} or more"
        return text


COUNT = Number(whole=True, low=1)
COUNT_OR_NONE = Number(whole=True, low=0)  # 0 is a count, too
AUTO_OR_COUNT = Number(whole=True, low=1, words=("auto",))
AUTO_OR_LEVELS = Number(whole=True, low=0, words=("auto",))
AUTO_OR_ANGLE = Number(low=0, high=math.pi, words=("auto",))
POSITIVE = Number(low=0, above=True)


class Size(NamedTuple):
    """Texels."""

    width: int
    height: int


def size(text: str | Size) -> Size:
    """`256` or `640x480`."""
    if isinstance(text, Size):
        return text
    words = text.lower().split("x")
    if len(words) > 2 or not all(word.isascii() and word.isdecimal() and int(word) > 0 for word in words):
        raise typer.BadParameter(f"expected N or WxH texels, found {text!r}")
    return Size(int(words[0]), int(words[-1]))


def duration(text: str | float) -> float:
    """Seconds of `90s`, `30m`, `8h`, `1h30m` or a plain number of seconds."""
    if not isinstance(text, str):
        return text
    found = re.fullmatch(r"(?:(\d+(?:\.\d+)?)h)?(?:(\d+(?:\.\d+)?)m)?(?:(\d+(?:\.\d+)?)s?)?", text.strip())
    seconds = sum(float(n or 0) * unit for n, unit in zip(found.groups(), (3600, 60, 1), strict=True)) if found else 0.0
    if seconds <= 0:
        raise typer.BadParameter(f"expected a duration as 90s, 30m or 8h, found {text!r}")
    return seconds


def parse_share(text: str) -> float:
    """`5%` or `.05`: above 0 and below 1."""
    percent = text.strip().endswith("%")
    try:
        share = float(text.strip().removesuffix("%")) / (100 if percent else 1)
    except ValueError:
        share = math.nan
    if not 0 < share < 1:
        raise InputError(f"expected a share above 0 and below 1, such as 5% or .05, found {text!r}")
    return share


@dataclass(frozen=True)
class Parsed(Generic[T]):
    """What a function of the library makes of a text; its InputError is wrong usage."""

    parse: Callable[[str], T]

    __name__ = "text"

    def __call__(self, text: Any) -> T:
        if not isinstance(text, str):
            return text
        try:
            return self.parse(text)
        except InputError as error:
            raise typer.BadParameter(str(error)) from error
