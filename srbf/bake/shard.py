"""Shards: one bake as several commands, for farms whose tasks are fixed before they run."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from srbf.bake.planned_lights import PlannedLight
from srbf.errors import InputError


@dataclass(frozen=True)
class Shard:
    """The lights that command `number` of `count` bakes, from 1 on; number 0: the preparation, which comes before all of them."""

    number: int
    count: int

    @staticmethod
    def parse(text: str) -> Shard:
        """From `prepare` or `I/N`; InputError for others."""
        if text == "prepare":
            return Shard(0, 0)
        found = re.fullmatch(r"([0-9]{1,6})/([0-9]{1,6})", text)
        number, count = (int(word) for word in found.groups()) if found else (0, 0)
        if not 1 <= number <= count:
            raise InputError(f"expected `shard` prepare or I/N with I from 1 to N, found {text!r}")
        return Shard(number, count)

    @property
    def is_preparation(self) -> bool:
        return self.number == 0

    @property
    def name(self) -> str:
        """As on the command line."""
        return "prepare" if self.is_preparation else f"{self.number}/{self.count}"

    @property
    def lock(self) -> str:
        """The lock file held while it is baked."""
        return f".shard-{self.number}-of-{self.count}.lock"

    @property
    def scratch(self) -> str:
        """Its folder for the worker's files."""
        return f"shard-{self.number}-of-{self.count}"

    def of(self, order: Sequence[PlannedLight]) -> list[PlannedLight]:
        """Every N-th light of the order of rendering, so that each shard covers the domain; none in the preparation."""
        return [] if self.is_preparation else list(order[self.number - 1 :: self.count])
