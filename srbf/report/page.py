"""The page of a report, as Markdown and as static HTML, from the same sections."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from srbf.capture import ROLES
from srbf.facts import folder_bytes
from srbf.files import write_text
from srbf.report.subject import Picture, Subject

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #262626; background: #fff; max-width: 1120px; margin: 2.5rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.7rem; margin-bottom: 0.2rem; } h2 { font-size: 1.15rem; margin-top: 2.4rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; } td, th { padding: 0.25rem 1.4rem 0.25rem 0; text-align: left; }
th { color: #707070; font-weight: 500; border-bottom: 1px solid #c9c9c9; } td { border-bottom: 1px solid #eee; }
figure { margin: 2.2rem 0; } img { max-width: 100%; height: auto; }
figcaption, .soft { color: #707070; font-size: 0.92rem; max-width: 75ch; }
li { max-width: 80ch; }
"""


@dataclass(frozen=True)
class Table:
    """A heading and rows of text under column names."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def write_page(
    subject: Subject, folder: Path, pictures: Sequence[Picture], timings: Mapping[str, float] | None, asset_folder: Path | None
) -> Path:
    """Write report.md and index.html; returns the latter."""
    asset = subject.asset
    title = f"Relighting report: {asset.width}×{asset.height} {subject.capture.quantity}, {asset.k} maps"
    lead = lead_of(subject)
    tables = [sizes(subject, asset_folder), fit_facts(subject), errors(subject)]
    if timings:
        tables.insert(1, Table("Times", ("step", "seconds"), tuple((name, f"{value:.2f}") for name, value in timings.items())))
    limits = limits_of(subject)
    write_text(folder / "report.md", _markdown(title, lead, tables, pictures, limits))
    write_text(folder / "index.html", _html(title, lead, tables, pictures, limits))
    return folder / "index.html"


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
        ("maps, uncompressed", f"{bytes_text(raw)}, {asset.k} maps, {asset.encoding}"),
        ("lights for each map", f"{len(capture.indices('train')) / asset.k:.1f} train images are folded into one map"),
        ("read by a shader of the texel's own maps", f"{asset.bytes_per_texel()['directional']} bytes a texel"),
        ("resident on a GPU, everything", bytes_text(asset.resident_bytes())),
    )
    return Table("Size", ("what", "how much"), rows)


def fit_facts(subject: Subject) -> Table:
    """What the manifest records of the fit."""
    asset = subject.asset
    spread = asset.basis.spread
    source = asset.manifest.get("source", {})
    rows = [
        ("maps k", str(asset.k)),
        ("spread Δ", f"{spread:.4f} rad ({np.degrees(spread):.1f}°)"),
        ("domain", asset.domain),
        ("quantity, transport", f"{asset.manifest['quantity']}, {asset.manifest.get('transport', 'combined')}"),
    ]
    rows += [(name.replace("_", " "), _number(value)) for name, value in source.get("fit", {}).items()]
    rows += [(name.replace("_", " "), _number(value)) for name, value in source.get("settings", {}).items() if name in ("centers", "ridge")]
    return Table("Fit", ("what", "value"), tuple(rows))


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
    return Table(f"Errors (peak {peak:.4g})", ("role", "lights", "rmse", "relative rmse", "psnr", "psnr pooled"), tuple(rows))


def limits_of(subject: Subject) -> list[str]:
    """What these pictures do not show, said plainly."""
    asset = subject.asset
    notes = [
        f"The basis is smooth: features of a receiver's answer finer than about the spread, "
        f"{np.degrees(asset.basis.spread):.0f}°, are blurred. Hard shadow edges soften and ring; sums below 0 are clamped.",
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
        lines += [f"## {table.title}", "", "| " + " | ".join(table.columns) + " |", "|" + " --- |" * len(table.columns)]
        lines += ["| " + " | ".join(row) + " |" for row in table.rows] + [""]
    lines += ["## Pictures", ""]
    for picture in pictures:
        image = [] if picture.omitted else [f"![{picture.title}]({picture.file})", ""]
        lines += [f"### {picture.title}", "", *image, picture.caption, ""]
    lines += ["## Limits", "", *(f"- {note}" for note in limits), ""]
    return "\n".join(lines)


def _html(title: str, lead: str, tables: Sequence[Table], pictures: Sequence[Picture], limits: Sequence[str]) -> str:
    e = html.escape
    parts = [f'<!doctype html>\n<html lang="en">\n<meta charset="utf-8">\n<title>{e(title)}</title>']
    parts += [
        f'<meta name="viewport" content="width=device-width">\n<style>{STYLE}</style>',
        f"<h1>{e(title)}</h1>\n<p>{e(lead)}</p>",
    ]
    for picture in pictures[:1]:
        parts.append(_figure(picture))
    for table in tables:
        head = "".join(f"<th>{e(name)}</th>" for name in table.columns)
        body = "\n".join("<tr>" + "".join(f"<td>{e(cell)}</td>" for cell in row) + "</tr>" for row in table.rows)
        parts.append(f"<h2>{e(table.title)}</h2>\n<table>\n<tr>{head}</tr>\n{body}\n</table>")
    parts += [_figure(picture) for picture in pictures[1:]]
    parts.append("<h2>Limits</h2>\n<ul>\n" + "\n".join(f"<li>{e(note)}</li>" for note in limits) + "\n</ul>\n</html>\n")
    return "\n".join(parts)


def _figure(picture: Picture) -> str:
    e = html.escape
    if picture.omitted:
        return f'<h2>{e(picture.title)}</h2>\n<p class="soft">{e(picture.caption)}</p>'
    image = f'<a href="{e(picture.file)}"><img src="{e(picture.file)}" alt="{e(picture.title)}"></a>'
    return f"<h2>{e(picture.title)}</h2>\n<figure>{image}\n<figcaption>{e(picture.caption)}</figcaption></figure>"
