"""The documentation as a site: every link leads somewhere, and pages read the same as on GitHub."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from environments import ROOT

import srbf

pytestmark = pytest.mark.packaging
pytest.importorskip("mkdocs")


@pytest.fixture(scope="module")
def hook() -> ModuleType:
    spec = importlib.util.spec_from_file_location("docs_site", ROOT / "scripts" / "docs_site.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path / "site")]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    for page in ("index", "commands/index", "changelog/index", "design/index", "contributing/index"):
        assert "<h1" in (tmp_path / "site" / f"{page}.html").read_text(encoding="utf-8")
    reference = (tmp_path / "site" / "reference" / "python" / "index.html").read_text(encoding="utf-8")
    public = [name for name in getattr(srbf, "__all__", ()) if not name.startswith("_")]
    assert [name for name in public if f'id="srbf.{name}"' not in reference] == []


@pytest.mark.parametrize(
    ("link", "source", "place", "expected"),
    [
        ("[a](docs/limits.md#x)", "CHANGELOG.md", "changelog.md", "[a](limits.md#x)"),
        ("[a](../../glsl/README.md)", "docs/engines/README.md", "engines/README.md", "[a](../glsl.md)"),
        ("![a](images/viewer.webp)", "docs/viewer.md", "viewer.md", "![a](images/viewer.webp)"),
        ("[a](srbf/lights.py)", "DESIGN.md", "design.md", "a"),
        ("[two\nlines](docs/limits.md)", "DESIGN.md", "design.md", "[two\nlines](limits.md)"),
        ("[a](docs/no_such_page.md)", "DESIGN.md", "design.md", "[a](docs/no_such_page.md)"),
        ("[a](https://example.org/docs)", "DESIGN.md", "design.md", "[a](https://example.org/docs)"),
        ("```\n[a](docs/limits.md)\n```", "DESIGN.md", "design.md", "```\n[a](docs/limits.md)\n```"),
    ],
)
def test_links(hook: ModuleType, link: str, source: str, place: str, expected: str) -> None:
    assert hook.with_links(link, source, place, {"limits.md", "glsl.md", "images/viewer.webp", "viewer.md"}) == expected


def test_lists_and_tables_are_apart_from_paragraphs(hook: ModuleType) -> None:
    assert hook.with_blank_lines("a\n- b\n  c\n- d\ne\n| f |\n|---|") == "a\n\n- b\n  c\n- d\ne\n\n| f |\n|---|"
    assert hook.with_blank_lines("```\na\n- b\n```") == "```\na\n- b\n```"
