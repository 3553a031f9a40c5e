"""What a report needs of each light domain: measurements, figures, tables, sections and limits."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import ClassVar

from srbf.methods import Method
from srbf.report.inline import Table
from srbf.report.section import Figure, Section
from srbf.report.subject import Picture, Subject


class DomainReport(ABC):
    """The part of a report that depends on what lights are: made of a subject by `measured`, then asked."""

    kinds: ClassVar[tuple[str, ...]]  # of the light domains
    steps: ClassVar[int]  # of `measured`, for progress
    drawings: ClassVar[int]  # that `figures` has

    @classmethod
    @abstractmethod
    def measured(cls, subject: Subject, methods: Sequence[Method], progress: Callable[[int, int], None]) -> DomainReport:
        """Measure all that the page says; `methods` are compared where the domain has some."""

    @abstractmethod
    def figures(self) -> tuple[Figure, ...]:
        """The pictures that are files too."""

    @abstractmethod
    def lead(self) -> str:
        """A summary in two sentences."""

    @abstractmethod
    def key(self) -> Sequence[tuple[str, str]]:
        """The most important numbers: (name, value)."""

    @abstractmethod
    def tables(self) -> Sequence[Table]:
        """For the Markdown file, before size and fit."""

    @abstractmethod
    def sections(self, pictures: Sequence[Picture], folder: Path) -> list[Section]:
        """Of the page, before facts and limits; `pictures` lie in `folder`."""

    @abstractmethod
    def limits(self) -> list[str]:
        """What these figures do not say, one sentence or two each."""
