"""The report on an asset of lights inside a scene: the error over the places of point lights, the worst of them, and motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from srbf.captured_light import ROLES
from srbf.errors import InputError, MissingLibraryError
from srbf.evaluation.cluster_borders import ClusterBorders, cluster_borders
from srbf.evaluation.motion_inside import MotionInside, move_inside
from srbf.evaluation.temporal_stability import TEXELS, sampled_texels
from srbf.lights import PointLight, triple
from srbf.methods import Method
from srbf.report.by_place import by_place
from srbf.report.by_texel import by_texel
from srbf.report.canvas import place_text
from srbf.report.domain_report import DomainReport
from srbf.report.facts import border_figures, read_bytes, split_errors
from srbf.report.findings import HeldOut, Spectrum, measure_held_out, spectrum_of
from srbf.report.held_out_lights import how_measured, table_of_lights, worst_lights
from srbf.report.in_motion import motion_inside_curves, motion_inside_figures
from srbf.report.inline import Table, paragraphs
from srbf.report.samples import samples_section
from srbf.report.section import Figure, Section, moving
from srbf.report.spectrum import spectrum_plots
from srbf.report.strips import ANIMATION, frame, write_animation
from srbf.report.subject import Picture, Subject

SHOWN_FRAMES = 24  # of the animation
UNTESTED = "Not shown: the capture holds point lights of no role; bake some with --holdout."


@dataclass(frozen=True, eq=False)
class PlacesReport(DomainReport):
    """Of lights by their places. `tested`: the point lights of the subject's role; `missing`: why there is no motion."""

    kinds: ClassVar[tuple[str, ...]] = ("cloud", "surfels", "pool")
    steps: ClassVar[int] = 3
    drawings: ClassVar[int] = 1
    subject: Subject
    held_out: HeldOut
    texels: int
    spectrum: Spectrum | None
    motion: MotionInside | None
    borders: ClusterBorders | None
    missing: str

    @classmethod
    def measured(cls, subject: Subject, methods: Sequence[Method], progress: Callable[[int, int], None]) -> PlacesReport:
        held_out = measure_held_out(subject, own_peak=True)
        progress(1, cls.steps)
        picked = sampled_texels(subject.covered, TEXELS)
        sample, asset = subject.capture.load(picked), subject.asset.at(picked)
        has_train = bool(sample.indices("train"))
        spectrum = spectrum_of(sample, asset, subject.evaluation[subject.role]["peak"]) if has_train else None
        progress(2, cls.steps)
        motion, missing = None, ""
        try:
            motion = move_inside(asset, subject.capture, picked)
        except (InputError, MissingLibraryError) as error:
            missing = f"Not measured: {error}."
        has_borders = "cluster_index" in subject.asset.tables and bool(_points(subject))
        borders = cluster_borders(subject.asset, subject.capture, subject.role) if has_borders else None
        progress(3, cls.steps)
        return cls(subject, held_out, len(picked), spectrum, motion, borders, missing)

    @property
    def tested(self) -> list[int]:
        return _points(self.subject)

    def figures(self) -> tuple[Figure, ...]:
        return (Figure(ANIMATION, "In motion", self._animation, self.missing or None, optional=True),)

    def lead(self) -> str:
        subject = self.subject
        error = subject.evaluation[subject.role]
        mean = self._mean(subject.role)
        of_mean = "" if mean is None else f" pooled, {100 * mean:.1f} % in the mean over lights"
        noise = f", of which the references have about {100 * error['noise']:.1f} % as noise" if "noise" in error else ""
        light = "indirect light" if subject.asset.transport == "indirect" else "light"
        return (
            f"On {len(subject.capture.indices(subject.role))} {subject.role_words} the relative RMSE of {light} is "
            f"{100 * error['relative_rmse']:.1f} %{of_mean}{noise}. Errors are over covered receivers, ambient excluded."
        )

    def key(self) -> Sequence[tuple[str, str]]:
        subject = self.subject
        figures = [(f"relative RMSE, pooled, {subject.role}", f"{100 * subject.evaluation[subject.role]['relative_rmse']:.1f} %")]
        if (mean := self._mean(subject.role)) is not None:
            worst = max(subject.relative_of(i) for i in self.tested)
            figures += [("mean over lights", f"{100 * mean:.1f} %"), ("worst light", f"{100 * worst:.1f} %")]
        figures.append(("read per texel", f"{read_bytes(subject.asset)} bytes"))
        if self.motion is not None:
            figures.append(("largest step in motion, over the reference's", f"{self.motion.largest_step:.2f}"))
            figures.append(("the same from the table of positions", f"{self.motion.table_step:.2f}"))
        return figures

    def tables(self) -> Sequence[Table]:
        tables = [self._by_role(), *split_errors(self.subject)]
        tables += [table_of_lights(self.held_out)] if self.tested else []
        tables += [motion_inside_figures(self.motion)] if self.motion is not None else []
        return tables + ([border_figures(self.borders)] if self.borders is not None else [])

    def sections(self, pictures: Sequence[Picture], folder: Path) -> list[Section]:
        subject = self.subject
        sections = [
            Section("Point lights inside the scene", self._lights()),
            Section("By place", by_place(subject, self.tested, self.motion) if self.tested else paragraphs(UNTESTED)),
            Section("In motion", self._motion(list(pictures), folder)),
            Section("By texel", by_texel(subject, self.held_out)),
            *([Section("Spectrum", spectrum_plots(subject, self.texels, self.spectrum))] if self.spectrum is not None else []),
        ]
        return sections + samples_section(subject.capture)

    def limits(self) -> list[str]:
        subject, asset = self.subject, self.subject.asset
        notes = [
            "Bounced light follows the lights, not the objects: what moves after the bake neither blocks nor bounces it.",
            "A light much closer to a surface than the cells and patches are wide is less exact in the texels around it. Tested lights "
            "keep their distance from surfaces, so these figures do not show it.",
        ]
        if asset.transport == "indirect":
            notes.append("The maps hold indirect light only: the engine adds the direct light, which these figures leave out.")
        if asset.manifest.get("interpolation", {}).get("kind") == "kernel":
            notes.append("The kernel between captured point lights knows no spots and no area lights; fingerprints and patches do.")
        if "ambient" in asset.images:
            notes.append("The scene emits light by itself: its ambient image is part of the animation, not of comparisons and errors.")
        if subject.role != "holdout":
            notes.append(f"There are no holdout lights: the comparison uses {subject.role_words}, whose error is lower.")
        return notes

    def _mean(self, role: str) -> float | None:
        """The mean over the point lights of a role; None without any."""
        lights = self.subject.capture.lights
        found = [self.subject.relative_of(i) for i, light in enumerate(lights) if light.role == role and light.kind == "point"]
        return float(np.mean(found)) if found else None

    def _by_role(self) -> Table:
        """Pooled, mean and worst relative error of every role, and where the worst light is."""
        subject, rows = self.subject, []
        for role in ROLES:
            if role not in subject.evaluation:
                continue
            indices = subject.capture.indices(role)
            worst = subject.worst_first(indices)[0]
            values = [subject.relative_of(i) for i in indices]
            kinds = {"point": "point lights", "patch": "patches"}.get(subject.capture.lights[worst].kind, "lights")
            cells = (100 * subject.evaluation[role]["relative_rmse"], 100 * float(np.mean(values)), 100 * max(values))
            rows.append(
                (f"{role}, {len(indices)} {kinds}", *(f"{cell:.1f} %" for cell in cells), ", ".join(subject.light_words(worst))),
            )
        light = "indirect light" if subject.asset.transport == "indirect" else "light"
        columns = ("role", "pooled", "mean over lights", "worst", "worst light")
        return Table(f"Relative RMSE of {light}", columns, tuple(rows), numbers=True)

    def _lights(self) -> str:
        subject = self.subject
        by_role = self._by_role()
        parts = [by_role.html(), worst_lights(subject, self.held_out)]
        if self.tested:
            lights = table_of_lights(self.held_out)
            parts += [f"<h3>{lights.title}</h3>", lights.html(), how_measured(self.held_out)]
        further = split_errors(subject)
        further += [border_figures(self.borders)] if self.borders is not None else []
        return "\n".join([*parts, *(f"<h3>{table.title}</h3>\n{table.html()}" for table in further)])

    def _motion(self, pictures: list[Picture], folder: Path) -> str:
        if self.motion is None:
            return paragraphs(self.missing)
        parts = [motion_inside_figures(self.motion).html(), motion_inside_curves(self.motion)]
        return "\n".join(parts + moving(pictures, folder))

    def _animation(self, folder: Path) -> Picture:
        """The asset under a light that moves along the path."""
        assert self.motion is not None
        rows = np.unique(np.linspace(0, len(self.motion.places) - 1, SHOWN_FRAMES).astype(np.int64))
        places = self.motion.places[rows]
        lights = [PointLight(triple(place), falloff="inverse-square") for place in places]
        path = write_animation([frame(self.subject, light) for light in lights], folder)
        words = f"{len(lights)} frames of a point light on its way from {place_text(places[0])} to {place_text(places[-1])} m."
        return Picture(path.name, "In motion", words)


def _points(subject: Subject) -> list[int]:
    """The point lights of the subject's role."""
    return [i for i in subject.capture.indices(subject.role) if subject.capture.lights[i].kind == "point"]
