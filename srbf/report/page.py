"""The page of a report: one HTML file that contains all figures, and a Markdown file beside the figures."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from pathlib import Path

from srbf.io.files import write_text
from srbf.report.domain_report import DomainReport
from srbf.report.facts import fit_facts, kept_words, sizes
from srbf.report.inline import Table
from srbf.report.section import Section
from srbf.report.subject import Picture, Subject

STYLE = Path(__file__).with_name("page.css")


def write_page(
    subject: Subject,
    report: DomainReport,
    folder: Path,
    pictures: Sequence[Picture],
    timings: Mapping[str, float] | None,
    asset_folder: Path | None,
) -> Path:
    """Write report.md and index.html; returns the latter, which needs no other file."""
    asset = subject.asset
    title = f"Relighting report: {asset.width}×{asset.height} {subject.capture.quantity}, {kept_words(subject)}"
    facts = [sizes(subject, asset_folder), fit_facts(subject)]
    if timings:
        facts.insert(1, Table("Times", ("step", "seconds"), tuple((name, f"{value:.2f}") for name, value in timings.items()), numbers=True))
    limits = report.limits()
    write_text(folder / "report.md", _markdown(title, report.lead(), [*report.tables(), *facts], pictures, limits))
    sections = report.sections(pictures, folder)
    boxes = "".join(f"<div><h3>{html.escape(table.title)}</h3>{table.html()}</div>" for table in facts)
    sections.append(Section("Facts", f'<div class="facts">{boxes}</div>'))
    sections.append(Section("Limits", "<ul>\n" + "\n".join(f"<li>{html.escape(note)}</li>" for note in limits) + "\n</ul>"))
    write_text(folder / "index.html", _html(title, report.lead(), _key_figures(report.key()), sections))
    return folder / "index.html"


def _key_figures(figures: Sequence[tuple[str, str]]) -> str:
    cells = "".join(f"<div><dd>{value}</dd><dt>{name}</dt></div>" for name, value in figures)
    return f'<dl class="key">{cells}</dl>'


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
