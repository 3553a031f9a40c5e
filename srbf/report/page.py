"""The page of a report: one HTML file that contains all figures, and a Markdown file beside the figures."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from srbf.asset import Asset
from srbf.captured_light import ROLES
from srbf.evaluation.cluster_borders import ClusterBorders
from srbf.evaluation.rate_distortion import family_of, name_of, texel_bytes
from srbf.info import folder_bytes
from srbf.io.files import write_text
from srbf.io.image import size_of
from srbf.methods import method_of
from srbf.report.by_bytes import by_bytes
from srbf.report.by_bytes import table as table_of_bytes
from srbf.report.by_direction import by_direction
from srbf.report.by_texel import by_texel
from srbf.report.findings import Findings
from srbf.report.held_out_lights import how_measured, table_of_lights, worst_directions
from srbf.report.in_motion import motion_curves, motion_figures
from srbf.report.inline import Table, data_uri, figure, image, paragraphs
from srbf.report.light_functions import light_functions
from srbf.report.samples import samples_plot
from srbf.report.spectrum import spectrum_plots
from srbf.report.subject import Picture, Subject

STYLE = Path(__file__).with_name("page.css")
MOVING_SUFFIXES = (".webp", ".gif")
WIDE_RATIO = 1.2  # width over height from which a sheet shares a printed page with another
DIRECT_METHODS = {"direct_ray": "direct light by rays, exact", "direct_shadow_map": "direct light by a shadow map"}  # keys of an evaluation


@dataclass(frozen=True)
class Section:
    """A heading and the HTML below it."""

    title: str
    body: str


def write_page(
    subject: Subject,
    findings: Findings,
    folder: Path,
    pictures: Sequence[Picture],
    timings: Mapping[str, float] | None,
    asset_folder: Path | None,
) -> Path:
    """Write report.md and index.html; returns the latter, which needs no other file."""
    asset = subject.asset
    title = f"Relighting report: {asset.width}×{asset.height} {subject.capture.quantity}, {kept_words(subject)}"
    lead = lead_of(subject)
    facts = [sizes(subject, asset_folder), fit_facts(subject)]
    if timings:
        facts.insert(1, Table("Times", ("step", "seconds"), tuple((name, f"{value:.2f}") for name, value in timings.items()), numbers=True))
    limits = limits_of(subject)
    tables = [errors(subject), *split_errors(subject), table_of_lights(findings.held_out), *bytes_and_motion(findings), *facts]
    write_text(folder / "report.md", _markdown(title, lead, tables, pictures, limits))
    sections = [
        Section("Held-out lights", held_out_section(subject, findings)),
        Section("By direction", by_direction(subject)),
        Section("Error by bytes", by_bytes(subject, findings) if findings.scores else paragraphs(findings.missing)),
    ]
    if findings.spectrum is not None:
        sections.append(Section("Spectrum", spectrum_plots(subject, findings, findings.spectrum)))
    if "light_basis" in asset.manifest:
        sections.append(Section("Light functions", light_functions(subject)))
    curve = subject.capture.manifest.get("source", {}).get("validation_curve")
    if curve:
        sections.append(Section("Samples", samples_plot(curve)))
    sections += [
        Section("By texel", by_texel(subject, findings.held_out)),
        Section("In motion", motion_section(findings, pictures, folder)),
    ]
    sections += [Section(picture.title, drawn(picture, folder)) for picture in pictures if Path(picture.file).suffix not in MOVING_SUFFIXES]
    boxes = "".join(f"<div><h3>{html.escape(table.title)}</h3>{table.html()}</div>" for table in facts)
    sections.append(Section("Facts", f'<div class="facts">{boxes}</div>'))
    sections.append(Section("Limits", "<ul>\n" + "\n".join(f"<li>{html.escape(note)}</li>" for note in limits) + "\n</ul>"))
    write_text(folder / "index.html", _html(title, lead, key_figures(subject, findings), sections))
    return folder / "index.html"


def kept_words(subject: Subject) -> str:
    """The asset's data per texel, as text."""
    return f"{family_of(subject.asset)} of {name_of(subject.asset)}"


def key_figures(subject: Subject, findings: Findings) -> str:
    """The most important numbers."""
    one = findings.held_out.errors[0]
    figures = [
        (f"PSNR, {subject.role}", f"{subject.evaluation[subject.role]['psnr']:.2f} dB"),
        ("worst light", f"{one.worst:.1f} dB"),
        ("at shadow edges", f"{one.edges:.1f} dB"),
        ("read per texel", f"{texel_bytes(subject.asset)} bytes"),
        ("of the energy is clamped", f"{findings.held_out.negative.energy:.2%}"),
    ]
    if findings.motion is not None:
        figures.append(("largest flicker in motion", f"{findings.motion.largest_flicker:.1%}"))
    cells = "".join(f"<div><dd>{value}</dd><dt>{name}</dt></div>" for name, value in figures)
    return f'<dl class="key">{cells}</dl>'


def held_out_section(subject: Subject, findings: Findings) -> str:
    """The worst directions, errors under several lights, errors by role, with direct light added, and at cluster borders."""
    held_out = findings.held_out
    lights, roles = table_of_lights(held_out), errors(subject)
    parts = [worst_directions(subject, held_out), f"<h3>{lights.title}</h3>", lights.html(), how_measured(held_out)]
    parts += [f"<h3>{roles.title}</h3>", roles.html()]
    further = split_errors(subject) + ([border_figures(findings.borders)] if findings.borders is not None else [])
    for table in further:
        parts += [f"<h3>{table.title}</h3>", table.html()]
    return "\n".join(parts)


def motion_section(findings: Findings, pictures: Sequence[Picture], folder: Path) -> str:
    """The sweep, whether the light spacing suffices, and the animation."""
    parts = [] if findings.sampling is None else [paragraphs(_sentence(findings.sampling.sentence()))]
    if findings.motion is None:
        parts.append(paragraphs(findings.missing))
    else:
        parts += [motion_figures(findings.motion).html(), motion_curves(findings.motion)]
    parts += [f'<div class="moving">{drawn(picture, folder)}</div>' for picture in pictures if Path(picture.file).suffix in MOVING_SUFFIXES]
    return "\n".join(parts)


def drawn(picture: Picture, folder: Path) -> str:
    """A figure's element, or the reason for its absence."""
    if picture.omitted:
        return f'<p class="soft">{html.escape(picture.caption)}</p>'
    path = folder / picture.file
    height, width = size_of(path) if path.suffix == ".png" else (1, 1)
    style = "sheet wide" if width > WIDE_RATIO * height else "sheet"
    return figure(image(data_uri(path), picture.title, style), picture.caption)


def bytes_and_motion(findings: Findings) -> list[Table]:
    """The tables of the method comparison, of the sweep and of cluster borders, as far as measured."""
    tables = [table_of_bytes(findings)] if findings.scores else []
    tables += [motion_figures(findings.motion)] if findings.motion is not None else []
    return tables + ([border_figures(findings.borders)] if findings.borders is not None else [])


def split_errors(subject: Subject) -> list[Table]:
    """Errors with direct light added, if the evaluation has them: {`direct_ray`, `direct_shadow_map`: {role: RoleError}}."""
    rows = []
    for key, words in DIRECT_METHODS.items():
        for role in ROLES:
            if role in (found := subject.evaluation.get(key, {})):
                e = found[role]
                rows.append((words, role, f"{e['rmse']:.4g}", f"{100 * e['relative_rmse']:.2f} %", f"{e['psnr']:.2f} dB"))
    columns = ("indirect maps and", "role", "rmse", "relative rmse", "PSNR")
    return [Table("With the direct light added", columns, tuple(rows))] if rows else []


def border_figures(borders: ClusterBorders) -> Table:
    """Errors across cluster borders beside errors next to them."""
    rows = (
        ("error, rms", f"{borders.error_at_border:.4g}", f"{borders.error_beside:.4g}", f"{borders.error_ratio:.2f}"),
        ("jump of the error, rms", f"{borders.jump_at_border:.4g}", f"{borders.jump_beside:.4g}", f"{borders.jump_ratio:.2f}"),
    )
    title = f"Cluster borders ({borders.border:.1%} of neighboring texels; a ratio of 1 is invisible)"
    return Table(title, ("measure", "at borders", "beside them", "ratio"), rows, numbers=True)


def lead_of(subject: Subject) -> str:
    """A summary in two sentences."""
    error = subject.evaluation[subject.role]
    return (
        f"On {len(subject.capture.indices(subject.role))} {subject.role_words} the relit images reach {error['psnr']:.1f} dB "
        f"(relative rmse {100 * error['relative_rmse']:.1f} %). Errors are over covered receivers, "
        "ambient excluded, both images clamped at 0."
    )


def sizes(subject: Subject, asset_folder: Path | None) -> Table:
    """Size of capture and asset."""
    asset, capture = subject.asset, subject.capture
    raw = asset.stored.nbytes
    rows = (
        ("capture on disk", f"{bytes_text(folder_bytes(capture.folder))}, {len(capture.lights)} lights"),
        *([("asset on disk", bytes_text(folder_bytes(asset_folder)))] if asset_folder else []),
        ("data of the texels, uncompressed", f"{bytes_text(raw)}, {name_of(asset)}, {asset.encoding}"),
        ("train responses per stored number", f"{3 * len(capture.indices('train')) / method_of(asset).numbers_per_texel(asset):.1f}"),
        ("read by a shader", f"{texel_bytes(asset)} bytes per texel"),
        ("resident on a GPU, with tables", bytes_text(asset.resident_bytes())),
    )
    return Table("Size", ("what", "how much"), rows)


def fit_facts(subject: Subject) -> Table:
    """The fit as recorded in the manifest."""
    asset = subject.asset
    spreads = np.array(spreads_of(asset))
    source = asset.manifest.get("source", {})
    rows = [
        ("method", f"{family_of(asset)}, {name_of(asset)}"),
        *([("spread Δ", spread_words(spreads))] if len(spreads) else []),
        ("domain", asset.domain),
        ("quantity, transport", f"{asset.manifest['quantity']}, {asset.manifest.get('transport', 'combined')}"),
    ]
    rows += [(name.replace("_", " "), _number(value)) for name, value in source.get("fit", {}).items()]
    rows += [
        (name.replace("_", " "), _number(value))
        for name, value in source.get("settings", {}).items()
        if name in ("centers", "ridge", "weighting")
    ]
    return Table("Fit", ("what", "value"), tuple(rows))


def spreads_of(asset: Asset) -> list[float]:
    """Spreads (rad) of the Gaussians in an asset's functions of direction; empty for other functions."""
    if "light_basis" in asset.manifest:
        return asset.manifest["light_basis"]["spreads"]
    return [asset.basis.spread] if asset.manifest["basis"]["kind"] == "gaussian" else []


def spread_words(spreads: np.ndarray) -> str:
    """One spread, or the range of several."""
    low, high = float(spreads.min()), float(spreads.max())
    if low == high:
        return f"{low:.4f} rad ({np.degrees(low):.1f}°)"
    return f"{low:.4f} to {high:.4f} rad ({np.degrees(low):.1f}° to {np.degrees(high):.1f}°)"


def errors(subject: Subject) -> Table:
    """Errors by role."""
    rows = []
    for role in ROLES:
        if role in subject.evaluation:
            e = subject.evaluation[role]
            count = len(subject.capture.indices(role))
            row = (
                role,
                str(count),
                f"{e['rmse']:.4g}",
                f"{100 * e['relative_rmse']:.2f} %",
                f"{e['psnr']:.2f} dB",
                f"{e['psnr_pooled']:.2f} dB",
            )
            rows.append(row)
    peak = subject.evaluation[subject.role]["peak"]
    return Table(f"Errors (peak {peak:.4g})", ("role", "lights", "rmse", "relative rmse", "psnr", "psnr pooled"), tuple(rows), numbers=True)


def limits_of(subject: Subject) -> list[str]:
    """The limits of these figures, one sentence or two each."""
    asset = subject.asset
    spreads = spreads_of(asset)
    finest = f"about the spread, {np.degrees(min(spreads)):.0f}°," if spreads else "its highest harmonics"
    notes = [
        f"The functions of direction are smooth: features of a receiver's response finer than {finest} are blurred. Hard shadow edges "
        "soften and ring; sums below 0 are clamped.",
        "A point or spot light inside a scene that was captured under directional lights is the article's approximation: every receiver "
        "uses its response to a distant light, so an occluder beyond the light still casts its shadow, and bounced light does not depend "
        "on the distance from the light to the surfaces that bounce it.",
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
        notes.append("The references are 8-bit photographs: the peak is 1, and their noise, clipping and stray light count as reference.")
    if subject.role != "holdout":
        notes.append(f"There are no holdout lights: the comparison uses {subject.role_words}, whose error is lower.")
    return notes


def bytes_text(count: int) -> str:
    """A size in binary units."""
    for unit, power in (("GiB", 30), ("MiB", 20), ("KiB", 10)):
        if count >= 1 << power:
            return f"{count / (1 << power):.1f} {unit}"
    return f"{count} bytes"


def _number(value: object) -> str:
    if value is None:
        return "infinite"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _markdown(title: str, lead: str, tables: Sequence[Table], pictures: Sequence[Picture], limits: Sequence[str]) -> str:
    lines = [f"# {title}", "", lead, ""]
    for table in tables:
        lines += [f"## {table.title}", "", *table.markdown(), ""]
    lines += ["## Figures", ""]
    for picture in pictures:
        image = [] if picture.omitted else [f"![{picture.title}]({picture.file})", ""]
        lines += [f"### {picture.title}", "", *image, picture.caption, ""]
    lines += ["## Limits", "", *(f"- {note}" for note in limits), ""]
    return "\n".join(lines)


def _html(title: str, lead: str, key: str, sections: Sequence[Section]) -> str:
    e = html.escape
    parts = [
        f'<!doctype html>\n<html lang="en">\n<meta charset="utf-8">\n<title>{e(title)}</title>',
        f'<meta name="viewport" content="width=device-width">\n<style>\n{STYLE.read_text(encoding="utf-8")}</style>',
        f"<h1>{e(title)}</h1>\n<p>{e(lead)}</p>\n{key}",
    ]
    parts += [f"<section>\n<h2>{e(section.title)}</h2>\n{section.body}\n</section>" for section in sections]
    return "\n".join(parts) + "\n</html>\n"


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]
