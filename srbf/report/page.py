"""The page of a report: one file of HTML that holds all its figures, and the same in Markdown beside pictures of its own."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from srbf.asset import Asset
from srbf.captured_light import ROLES
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
from srbf.report.in_motion import motion_curves, motion_figures
from srbf.report.inline import Table, data_uri, figure, image, paragraphs
from srbf.report.light_functions import light_functions
from srbf.report.samples import samples_plot
from srbf.report.spectrum import spectrum_plots
from srbf.report.subject import Picture, Subject
from srbf.report.unseen_light import how_measured, table_of_lights, worst_directions

STYLE = Path(__file__).with_name("page.css")
MOVING = (".webp", ".gif")
WIDE = 1.2  # a sheet so much wider than high shares a printed page with another
DIRECT = {"direct_ray": "direct light by rays, exact", "direct_shadow_map": "direct light by a shadow map"}  # keys of an evaluation


@dataclass(frozen=True)
class Section:
    """A heading and ready HTML under it."""

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
    """Write report.md and index.html; returns the latter, which needs no file beside it."""
    asset = subject.asset
    title = f"Relighting report: {asset.width}×{asset.height} {subject.capture.quantity}, {kept_words(subject)}"
    lead = lead_of(subject)
    facts = [sizes(subject, asset_folder), fit_facts(subject)]
    if timings:
        facts.insert(1, Table("Times", ("step", "seconds"), tuple((name, f"{value:.2f}") for name, value in timings.items()), numbers=True))
    limits = limits_of(subject)
    tables = [errors(subject), *split_errors(subject), table_of_lights(findings.unseen), *bytes_and_motion(findings), *facts]
    write_text(folder / "report.md", _markdown(title, lead, tables, pictures, limits))
    sections = [
        Section("Under unseen light", unseen_section(subject, findings)),
        Section("By direction", by_direction(subject)),
        Section("What a byte buys", by_bytes(subject, findings) if findings.scores else paragraphs(findings.missing)),
    ]
    if findings.spectrum is not None:
        sections.append(Section("Spectrum", spectrum_plots(subject, findings, findings.spectrum)))
    if "light_basis" in asset.manifest:
        sections.append(Section("Light functions", light_functions(subject)))
    curve = subject.capture.manifest.get("source", {}).get("validation_curve")
    if curve:
        sections.append(Section("Samples", samples_plot(curve)))
    sections += [
        Section("Where the error is", by_texel(subject, findings.unseen)),
        Section("In motion", motion_section(findings, pictures, folder)),
    ]
    sections += [Section(picture.title, drawn(picture, folder)) for picture in pictures if Path(picture.file).suffix not in MOVING]
    boxes = "".join(f"<div><h3>{html.escape(table.title)}</h3>{table.html()}</div>" for table in facts)
    sections.append(Section("In figures", f'<div class="facts">{boxes}</div>'))
    sections.append(Section("Limits", "<ul>\n" + "\n".join(f"<li>{html.escape(note)}</li>" for note in limits) + "\n</ul>"))
    write_text(folder / "index.html", _html(title, lead, key_figures(subject, findings), sections))
    return folder / "index.html"


def kept_words(subject: Subject) -> str:
    """What the asset keeps of a texel, in words."""
    return f"{family_of(subject.asset)} of {name_of(subject.asset)}"


def key_figures(subject: Subject, findings: Findings) -> str:
    """The few numbers that one asks for first."""
    one = findings.unseen.errors[0]
    figures = [
        (f"PSNR, {subject.role}", f"{subject.evaluation[subject.role]['psnr']:.2f} dB"),
        ("worst light", f"{one.worst:.1f} dB"),
        ("at shadow edges", f"{one.edges:.1f} dB"),
        ("read of a texel", f"{texel_bytes(subject.asset)} bytes"),
        ("of the energy is clamped", f"{findings.unseen.negative.energy:.2%}"),
    ]
    if findings.motion is not None:
        figures.append(("largest ripple in motion", f"{findings.motion.largest_ripple:.1%}"))
    cells = "".join(f"<div><dd>{value}</dd><dt>{name}</dt></div>" for name, value in figures)
    return f'<dl class="key">{cells}</dl>'


def unseen_section(subject: Subject, findings: Findings) -> str:
    """The worst directions, errors under several lights, errors by role, and with the direct light added where it was left out."""
    unseen = findings.unseen
    lights, roles = table_of_lights(unseen), errors(subject)
    parts = [worst_directions(subject, unseen), f"<h3>{lights.title}</h3>", lights.html(), how_measured(unseen)]
    parts += [f"<h3>{roles.title}</h3>", roles.html()]
    for table in split_errors(subject):
        parts += [f"<h3>{table.title}</h3>", table.html()]
    return "\n".join(parts)


def motion_section(findings: Findings, pictures: Sequence[Picture], folder: Path) -> str:
    """The sweep, whether the lights are close enough, and the animation."""
    parts = [] if findings.sampling is None else [paragraphs(_sentence(findings.sampling.sentence()))]
    if findings.motion is None:
        parts.append(paragraphs(findings.missing))
    else:
        parts += [motion_figures(findings.motion).html(), motion_curves(findings.motion)]
    parts += [f'<div class="moving">{drawn(picture, folder)}</div>' for picture in pictures if Path(picture.file).suffix in MOVING]
    return "\n".join(parts)


def drawn(picture: Picture, folder: Path) -> str:
    """A picture's file as an element, or why there is none."""
    if picture.omitted:
        return f'<p class="soft">{html.escape(picture.caption)}</p>'
    path = folder / picture.file
    height, width = size_of(path) if path.suffix == ".png" else (1, 1)
    style = "sheet wide" if width > WIDE * height else "sheet"
    return figure(image(data_uri(path), picture.title, style), picture.caption)


def bytes_and_motion(findings: Findings) -> list[Table]:
    """The tables of the contest and of the sweep, where there are any."""
    tables = [table_of_bytes(findings)] if findings.scores else []
    return tables + ([motion_figures(findings.motion)] if findings.motion is not None else [])


def split_errors(subject: Subject) -> list[Table]:
    """Errors with the direct light added, where the evaluation has them: {`direct_ray`, `direct_shadow_map`: {role: RoleError}}."""
    rows = []
    for key, words in DIRECT.items():
        for role in ROLES:
            if role in (found := subject.evaluation.get(key, {})):
                e = found[role]
                rows.append((words, role, f"{e['rmse']:.4g}", f"{100 * e['relative_rmse']:.2f} %", f"{e['psnr']:.2f} dB"))
    columns = ("indirect maps and", "role", "rmse", "relative rmse", "PSNR")
    return [Table("With the direct light added", columns, tuple(rows))] if rows else []


def lead_of(subject: Subject) -> str:
    """What was compared, in two sentences."""
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
        ("texels' own data, uncompressed", f"{bytes_text(raw)}, {name_of(asset)}, {asset.encoding}"),
        ("train answers for each number kept", f"{3 * len(capture.indices('train')) / method_of(asset).numbers_per_texel(asset):.1f}"),
        ("read by a shader of the texel's own data", f"{texel_bytes(asset)} bytes a texel"),
        ("resident on a GPU, everything", bytes_text(asset.resident_bytes())),
    )
    return Table("Size", ("what", "how much"), rows)


def fit_facts(subject: Subject) -> Table:
    """What the manifest records of the fit."""
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
    """Spreads (rad) of the Gaussians that an asset's functions of direction are made of; none where they are others."""
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
    """What these pictures do not show, said plainly."""
    asset = subject.asset
    spreads = spreads_of(asset)
    finest = f"about the spread, {np.degrees(min(spreads)):.0f}°," if spreads else "its highest harmonics"
    notes = [
        f"The functions of direction are smooth: features of a receiver's answer finer than {finest} are blurred. Hard shadow edges soften "
        "and ring; sums below 0 are clamped.",
        "A point or spot light inside a scene that was captured under directional lights is the article's approximation: every receiver "
        "uses its answer to a light at infinity, so an occluder beyond the lamp still casts its shadow, and the light that "
        "reaches it by bouncing does not know how far the lamp is from the surfaces that bounced it.",
    ]
    if asset.domain == "hemisphere":
        notes.append("Only the hemisphere z > 0 was captured: what a light from below gives is extrapolated and means little.")
    if asset.manifest.get("transport") == "indirect":
        notes.append("The maps hold indirect light alone: the engine adds the direct light of each lamp, and these pictures do not.")
    if "ambient" in asset.images:
        notes.append(
            "The scene emits light by itself: its ambient image is part of the strips and the animation, not of comparisons and errors."
        )
    if subject.capture.source_bits == 8:
        notes.append(
            "The references are 8-bit photographs: the peak is 1, and noise, clipping and stray light of the pictures count as truth."
        )
    if subject.role != "holdout":
        notes.append(f"There are no holdout lights: the comparison is on {subject.role_words}, which is kinder than unseen light.")
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
    lines += ["## Pictures", ""]
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
