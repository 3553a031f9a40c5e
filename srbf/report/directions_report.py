"""The report on an asset of directional lights: held-out directions, error by bytes, motion, and the article's figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import ClassVar

import numpy as np

from srbf.methods import Method
from srbf.report.abrdf_mosaic import abrdf_tiles
from srbf.report.by_bytes import by_bytes
from srbf.report.by_bytes import table as table_of_bytes
from srbf.report.by_direction import by_direction
from srbf.report.by_texel import by_texel
from srbf.report.contact_sheet import contact_sheet
from srbf.report.domain_report import DomainReport
from srbf.report.facts import border_figures, errors, read_bytes, split_errors, spreads_of
from srbf.report.findings import STEPS, Findings, measure
from srbf.report.held_out_lights import how_measured, table_of_lights, worst_lights
from srbf.report.in_motion import motion_curves, motion_figures
from srbf.report.inline import Table, paragraphs
from srbf.report.light_functions import light_functions
from srbf.report.maps import sum_of_maps
from srbf.report.point_light import point_light
from srbf.report.samples import samples_section
from srbf.report.section import Figure, Section, drawn, is_moving, moving
from srbf.report.spectrum import spectrum_plots
from srbf.report.sphere import centers, r_curve
from srbf.report.strips import animation, point_strip, spot_strip
from srbf.report.subject import Picture, Subject

Draw = Callable[[Subject, Path], Picture]
MAPS, POSITION = "maps", "position"  # requirements of a figure on the asset
REASONS = {
    MAPS: "Not drawn: this picture shows the terms of a relighting map of Gaussians, and the asset holds other functions.",
    POSITION: "Not drawn: the asset has no position map (photographs never have one), which a point light needs.",
}
FIGURES: tuple[tuple[str, str, Draw, tuple[str, ...]], ...] = (  # file, title, function, requirements
    ("contact_sheet.png", "Reference against relit", contact_sheet, ()),
    ("animation.webp", "In motion", animation, ()),
    ("sum_of_maps.png", "A sum of maps", sum_of_maps, (MAPS,)),
    ("point_light.png", "A point light", point_light, (MAPS, POSITION)),
    ("point_strip.png", "Point lights", point_strip, (POSITION,)),
    ("spot_strip.png", "Spot lights", spot_strip, (POSITION,)),
    ("abrdf_tiles.png", "ABRDF tiles", abrdf_tiles, ()),
    ("centers.png", "Centers and lights", centers, (MAPS,)),
    ("r_curve.png", "The curve R", r_curve, (MAPS,)),
)


@dataclass(frozen=True, eq=False)
class DirectionsReport(DomainReport):
    """Of lights at infinity."""

    kinds: ClassVar[tuple[str, ...]] = ("directions",)
    steps: ClassVar[int] = STEPS
    drawings: ClassVar[int] = len(FIGURES)
    subject: Subject
    findings: Findings

    @classmethod
    def measured(cls, subject: Subject, methods: Sequence[Method], progress: Callable[[int, int], None]) -> DirectionsReport:
        return cls(subject, measure(subject, methods, progress))

    def figures(self) -> tuple[Figure, ...]:
        subject = self.subject
        has = {MAPS: subject.asset.manifest.get("basis", {}).get("kind") == "gaussian", POSITION: bool(subject.points)}
        return tuple(
            Figure(file, title, partial(draw, subject), next((REASONS[need] for need in needs if not has[need]), None), draw is animation)
            for file, title, draw, needs in FIGURES
        )

    def lead(self) -> str:
        subject = self.subject
        error = subject.evaluation[subject.role]
        return (
            f"On {len(subject.capture.indices(subject.role))} {subject.role_words} the relit images reach {error['psnr']:.1f} dB "
            f"(relative rmse {100 * error['relative_rmse']:.1f} %). Errors are over covered receivers, "
            "ambient excluded, both images clamped at 0."
        )

    def key(self) -> Sequence[tuple[str, str]]:
        subject, one = self.subject, self.findings.held_out.errors[0]
        figures = [
            (f"PSNR, {subject.role}", f"{subject.evaluation[subject.role]['psnr']:.2f} dB"),
            ("worst light", f"{one.worst:.1f} dB"),
            ("at shadow edges", f"{one.edges:.1f} dB"),
            ("read per texel", f"{read_bytes(subject.asset)} bytes"),
            ("of the energy is clamped", f"{self.findings.held_out.negative.energy:.2%}"),
        ]
        if self.findings.motion is not None:
            figures.append(("largest flicker in motion", f"{self.findings.motion.largest_flicker:.1%}"))
        return figures

    def tables(self) -> Sequence[Table]:
        subject, findings = self.subject, self.findings
        tables = [errors(subject), *split_errors(subject), table_of_lights(findings.held_out)]
        tables += [table_of_bytes(findings)] if findings.scores else []
        tables += [motion_figures(findings.motion)] if findings.motion is not None else []
        return tables + ([border_figures(findings.borders)] if findings.borders is not None else [])

    def sections(self, pictures: Sequence[Picture], folder: Path) -> list[Section]:
        subject, findings = self.subject, self.findings
        sections = [
            Section("Held-out lights", self._held_out()),
            Section("By direction", by_direction(subject)),
            Section("Error by bytes", by_bytes(subject, findings) if findings.scores else paragraphs(findings.missing)),
        ]
        if findings.spectrum is not None:
            sections.append(Section("Spectrum", spectrum_plots(subject, findings.texels, findings.spectrum)))
        if "light_basis" in subject.asset.manifest:
            sections.append(Section("Light functions", light_functions(subject)))
        sections += samples_section(subject.capture)
        sections += [
            Section("By texel", by_texel(subject, findings.held_out)),
            Section("In motion", self._motion(list(pictures), folder)),
        ]
        return sections + [Section(picture.title, drawn(picture, folder)) for picture in pictures if not is_moving(picture)]

    def limits(self) -> list[str]:
        subject, asset = self.subject, self.subject.asset
        spreads = spreads_of(asset)
        finest = f"about the spread, {np.degrees(min(spreads)):.0f}°," if spreads else "its highest harmonics"
        notes = [
            f"The functions of direction are smooth: features of a receiver's response finer than {finest} are blurred. Hard shadow edges "
            "soften and ring; sums below 0 are clamped.",
            "A point or spot light inside a scene that was captured under directional lights is the article's approximation: every "
            "receiver uses its response to a distant light, so an occluder beyond the light still casts its shadow, and bounced light "
            "does not depend on the distance from the light to the surfaces that bounce it.",
        ]
        if asset.domain == "hemisphere":
            notes.append("Only the hemisphere z > 0 was captured: the response to a light from below is an extrapolation.")
        if asset.manifest.get("transport") == "indirect":
            notes.append("The maps hold indirect light only: the engine adds the direct light, which these figures leave out.")
        if "ambient" in asset.images:
            notes.append(
                "The scene emits light by itself: its ambient image is part of the strips and the animation, not of comparisons and errors."
            )
        if subject.capture.source_bits == 8:
            notes.append(
                "The references are 8-bit photographs: the peak is 1, and their noise, clipping and stray light count as reference."
            )
        if subject.role != "holdout":
            notes.append(f"There are no holdout lights: the comparison uses {subject.role_words}, whose error is lower.")
        return notes

    def _held_out(self) -> str:
        """The worst directions, errors under several lights, errors by role, with direct light added, and at cluster borders."""
        subject, held_out = self.subject, self.findings.held_out
        lights = table_of_lights(held_out)
        parts = [worst_lights(subject, held_out), f"<h3>{lights.title}</h3>", lights.html(), how_measured(held_out)]
        further = [errors(subject), *split_errors(subject)]
        further += [border_figures(self.findings.borders)] if self.findings.borders is not None else []
        return "\n".join([*parts, *(f"<h3>{table.title}</h3>\n{table.html()}" for table in further)])

    def _motion(self, pictures: list[Picture], folder: Path) -> str:
        """The sweep, whether the light spacing suffices, and the animation."""
        findings = self.findings
        parts = []
        if findings.sampling is not None:
            sentence = findings.sampling.sentence()
            parts.append(paragraphs(sentence[:1].upper() + sentence[1:]))
        if findings.motion is None:
            parts.append(paragraphs(findings.missing))
        else:
            parts += [motion_figures(findings.motion).html(), motion_curves(findings.motion)]
        return "\n".join(parts + moving(pictures, folder))
