"""Every work that is cited by its key is in the bibliography."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
READ = {".py", ".md", ".glsl", ".frag", ".vert", ".ts", ".gd", ".cs"}
IN_BRACKETS = re.compile(r"\[([A-Z][A-Za-z]+\d{4})(?:[,;\]])")
IN_HEADERS = re.compile(r"^\s*cite:\s+([A-Z][A-Za-z]+\d{4})", re.MULTILINE)


def test_every_key_is_in_the_bibliography() -> None:
    known = set(re.findall(r"^@\w+\{(\w+),", (ROOT / "BIBLIOGRAPHY.bib").read_text(), re.MULTILINE))
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True, check=True)
    cited: dict[str, str] = {}
    for name in listed.stdout.splitlines():
        path = ROOT / name
        if path.suffix in READ and path.is_file() and path != Path(__file__):
            text = path.read_text(encoding="utf-8")
            cited |= dict.fromkeys(IN_BRACKETS.findall(text) + IN_HEADERS.findall(text), name)
    assert len(cited) > 15
    assert {key: where for key, where in cited.items() if key not in known} == {}
