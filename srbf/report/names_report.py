"""The report on an asset of a scene's own lights: random mixes, and the error of every light by its name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from srbf.evaluation.cluster_borders import ClusterBorders, cluster_borders
from srbf.evaluation.random_mixes import MixErrors, mix_errors
from srbf.evaluation.temporal_stability import TEXELS, sampled_texels
from srbf.methods import Method
from srbf.report.by_texel import by_texel
from srbf.report.domain_report import DomainReport
from srbf.report.facts import border_figures, errors, read_bytes, split_errors
from srbf.report.findings import HeldOut, Spectrum, measure_held_out, spectrum_of
from srbf.report.held_out_lights import worst_lights
from srbf.report.inline import Table, paragraphs
from srbf.report.mixes import WORDS, mix_strip, mix_table, sorted_mixes
from srbf.report.samples import samples_section
from srbf.report.section import Figure, Section
from srbf.report.spectrum import spectrum_plots
from srbf.report.subject import Picture, Subject

MOST_ROWS = 48  # of lights in the table


@dataclass(frozen=True, eq=False)
class NamesReport(DomainReport):
    """Of lights by their names. `brightness`: the mean response to each of the subject's lights, by file."""

    kinds: ClassVar[tuple[str, ...]] = ("named",)
    steps: ClassVar[int] = 3
    drawings: ClassVar[int] = 0
    subject: Subject
    mixes: MixErrors
    held_out: HeldOut
    texels: int
    spectrum: Spectrum
    brightness: dict[int, float]
    borders: ClusterBorders | None

    @classmethod
    def measured(cls, subject: Subject, methods: Sequence[Method], progress: Callable[[int, int], None]) -> NamesReport:
        mixes = mix_errors(subject.asset, subject.capture)
        progress(1, cls.steps)
        held_out = measure_held_out(subject)
        progress(2, cls.steps)
        picked = sampled_texels(subject.covered, TEXELS)
        sample, asset = subject.capture.load(picked), subject.asset.at(picked)
        spectrum = spectrum_of(sample, asset, subject.evaluation[subject.role]["peak"])
        train = sample.indices("train")
        means = sample.sample(train, np.arange(len(picked))).mean(axis=(0, 2), dtype=np.float64)
        borders = cluster_borders(subject.asset, subject.capture, subject.role) if "cluster_index" in subject.asset.tables else None
        progress(3, cls.steps)
        return cls(subject, mixes, held_out, len(picked), spectrum, dict(zip(train, means.tolist(), strict=True)), borders)

    def figures(self) -> tuple[Figure, ...]:
        return ()

    def lead(self) -> str:
        mixes, lights = self.mixes, len(self.subject.capture.indices("train"))
        return (
            f"On {mixes.count} random mixes of {lights} lights the relit images reach {mixes.psnr:.1f} dB in the mean and "
            f"{mixes.worst:.1f} dB at worst (relative rmse {100 * mixes.relative_rmse:.2g} %). "
            "Errors are over covered receivers, ambient excluded."
        )

    def key(self) -> Sequence[tuple[str, str]]:
        subject = self.subject
        worst = subject.worst_first(subject.capture.indices("train"))[0]
        return [
            (f"PSNR, {self.mixes.count} random mixes", f"{self.mixes.psnr:.2f} dB"),
            ("worst mix", f"{self.mixes.worst:.1f} dB"),
            ("worst light alone", f"{subject.psnr_of(worst):.1f} dB"),
            ("lights", str(len(subject.capture.indices("train")))),
            ("read per texel", f"{read_bytes(subject.asset)} bytes"),
        ]

    def tables(self) -> Sequence[Table]:
        tables = [mix_table(self.mixes), self._by_light(), errors(self.subject), *split_errors(self.subject)]
        return tables + ([border_figures(self.borders)] if self.borders is not None else [])

    def sections(self, pictures: Sequence[Picture], folder: Path) -> list[Section]:
        subject = self.subject
        mixes = [mix_table(self.mixes).html(), mix_strip(subject, self.mixes), sorted_mixes(self.mixes), paragraphs(WORDS)]
        sections = [
            Section("Random mixes", "\n".join(mixes)),
            Section("By light", self._lights()),
            Section("By texel", by_texel(subject, self.held_out)),
            Section("Spectrum", spectrum_plots(subject, self.texels, self.spectrum)),
        ]
        return sections + samples_section(subject.capture)

    def limits(self) -> list[str]:
        asset = self.subject.asset
        notes = [
            "The lights are those that the scene had at the bake: where they are and how they shine is fixed; only intensity and color "
            "are free.",
            "Every light was fitted, so that these are errors of compression; the noise of the bake counts as reference.",
        ]
        if asset.transport == "indirect":
            notes.append("The maps hold indirect light only: the engine adds the direct light, which these figures leave out.")
        if "ambient" in asset.images:
            notes.append("What shines besides the named lights is in the ambient image, which these figures leave out.")
        return notes

    def _lights(self) -> str:
        subject = self.subject
        table = self._by_light()
        parts = [worst_lights(subject, self.held_out), f"<h3>{table.title}</h3>", table.html()]
        further = [errors(subject), *split_errors(subject)]
        further += [border_figures(self.borders)] if self.borders is not None else []
        return "\n".join([*parts, *(f"<h3>{entry.title}</h3>\n{entry.html()}" for entry in further)])

    def _by_light(self) -> Table:
        """PSNR of every light alone, the worst first, and its share of the light when all are on."""
        subject = self.subject
        every = subject.worst_first(subject.capture.indices("train"))
        total = max(sum(self.brightness.values()), 1e-30)
        rows = tuple(
            (
                str(subject.capture.lights[i].name),
                f"{subject.psnr_of(i):.2f} dB",
                f"{100 * subject.relative_of(i):.2f} %",
                f"{self.brightness[i] / total:.1%}",
            )
            for i in every[:MOST_ROWS]
        )
        title = "Each light alone, worst first" + (f" ({MOST_ROWS} of {len(every)})" if len(every) > MOST_ROWS else "")
        return Table(title, ("light", "PSNR", "relative rmse", "share of all light"), rows, numbers=True)
