"""Hook of MkDocs: pages of the repository that are outside docs/, and links between all pages that hold on GitHub and on the site.

A link to a file that is no page of the site becomes plain text: the site has no copy of the sources.
"""

from __future__ import annotations

import posixpath
import re
from itertools import groupby
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parent.parent
LIVE = ROOT / "build" / "live"
# File of the repository -> its path on the site, beside those of docs/.
BROUGHT_IN = {
    "DESIGN.md": "design.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "BIBLIOGRAPHY.bib": "bibliography.bib",
    "README.md": "index.md",  # for links alone: docs/index.md is the front page
    "data/README.md": "data.md",
    "glsl/README.md": "glsl.md",
    "web/README.md": "web.md",
}
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
FENCE = re.compile(r"^\s*```")
ITEM = re.compile(r"(?:[-*]|\d+\.) ")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Live scenes beside the front page, where scripts/live_pages.py has made them."""
    if (LIVE / "live.md").is_file() and config.nav:
        config.nav.insert(1, {"Live scenes": "live.md"})
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are outside docs/."""
    brought = {target: ROOT / source for source, target in BROUGHT_IN.items()}
    live = {path.relative_to(LIVE).as_posix(): path for path in [LIVE / "live.md", *LIVE.glob("live/*.html")] if path.is_file()}
    for target, path in (brought | live).items():
        if files.get_file_from_path(target) is None:
            files.append(File.generated(config, target, abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Links as the site needs them, and a blank line before lists and tables, which GitHub does without."""
    origin = {target: source for source, target in BROUGHT_IN.items() if source != "README.md"}
    place = page.file.src_uri
    return with_blank_lines(with_links(markdown, origin.get(place, f"docs/{place}"), place, {file.src_uri for file in files}))


def with_links(markdown: str, source: str, place: str, known: set[str]) -> str:
    """The text of the file `source` with its links as they are from `place` on a site of the files `known`."""

    def link(found: re.Match[str]) -> str:
        picture, text, address = found.groups()
        path, mark, anchor = address.partition("#")
        if "://" in address or not path:
            return found[0]
        target = posixpath.normpath(posixpath.join(posixpath.dirname(source), path))
        if (ROOT / target).is_dir():
            target = f"{target}/README.md"
        on_site = BROUGHT_IN.get(target, target.removeprefix("docs/") if target.startswith("docs/") else None)
        if not (ROOT / target).exists():
            return found[0]  # MkDocs names it, and fails
        if on_site not in known:
            return text
        return f"{picture}[{text}]({posixpath.relpath(on_site, posixpath.dirname(place) or '.')}{mark}{anchor})"

    found = []
    for code, lines in groupby(_lines(markdown), key=lambda line: line[1]):
        text = "\n".join(line for line, _ in lines)
        found.append(text if code else LINK.sub(link, text))  # a link's text may go on over the end of a line
    return "\n".join(found)


def with_blank_lines(markdown: str) -> str:
    """Lists and tables apart from the paragraph before them, as Python-Markdown wants them."""
    found: list[str] = []
    in_list = False
    for line, code in _lines(markdown):
        before = found[-1] if found else ""
        starts_list = bool(ITEM.match(line)) and not in_list
        starts_table = line.startswith("|") and not before.startswith("|")
        if not code and before.strip() and (starts_list or starts_table):
            found.append("")
        in_list = not code and (bool(ITEM.match(line)) or (in_list and (line.startswith(" ") or not line.strip())))
        found.append(line)
    return "\n".join(found)


def _lines(markdown: str) -> list[tuple[str, bool]]:
    """Each line, and whether it is code."""
    found, code = [], False
    for line in markdown.split("\n"):
        fence = bool(FENCE.match(line))
        found.append((line, code or fence))
        code ^= fence
    return found
