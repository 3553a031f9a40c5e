"""`--part prepare` and `--part I/N`: one bake as several commands, for farms whose tasks must be known beforehand."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from srbf.bake.settings import PlannedLight
from srbf.errors import InputError


@dataclass(frozen=True)
class Part:
    """The lights that one of `count` commands bakes, from 1 on; number 0: the preparation, which comes before all of them."""

    number: int
    count: int

    @staticmethod
    def parse(text: str) -> Part:
        """From the command line's word; InputError on any other."""
        if text == "prepare":
            return Part(0, 0)
        found = re.fullmatch(r"([0-9]{1,6})/([0-9]{1,6})", text)
        number, count = (int(word) for word in found.groups()) if found else (0, 0)
        if not 1 <= number <= count:
            raise InputError(f"expected prepare or I/N with I from 1 to N, found {text!r}")
        return Part(number, count)

    @property
    def is_preparation(self) -> bool:
        return self.number == 0

    @property
    def name(self) -> str:
        """As the command line has it."""
        return "prepare" if self.is_preparation else f"{self.number}/{self.count}"

    @property
    def lock(self) -> str:
        """The file that is held while it is baked."""
        return f".part-{self.number}-of-{self.count}.lock"

    @property
    def scratch(self) -> str:
        """Its folder for what a worker hands over."""
        return f"part-{self.number}-of-{self.count}"

    def of(self, order: Sequence[PlannedLight]) -> list[PlannedLight]:
        """Every N-th light of the order of rendering, so that each part covers the domain; none in the preparation."""
        return [] if self.is_preparation else list(order[self.number - 1 :: self.count])
