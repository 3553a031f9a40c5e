"""`python scripts/check_words.py [PATH...]`: words that a reader of the field would have to look up, with the words to use instead.

Scans the project's tracked text; `make check` runs it. A line that needs a word, such as the name of another program's class, ends in a
comment with the marker `words: ok`. Files without comments have their names in ALLOWED.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MARKER = "words: ok"
SUFFIXES = {
    ".py",
    ".md",
    ".ts",
    ".mjs",
    ".glsl",
    ".frag",
    ".vert",
    ".cs",
    ".gd",
    ".gdshader",
    ".gdshaderinc",
    ".cpp",
    ".h",
    ".ush",
    ".shader",
    ".hlsl",
    ".html",
    ".css",
}
SUFFIXES |= {".json", ".toml"}
NAMES = {"Makefile", "make-venv", "godot-chroot", "debian-packages"}  # text files without a suffix

UNITS = "texel|pixel|map|light|frame|cluster|point|plane|meter|second|set|worker|layer|row|loop|vertex|channel|function|scenario|scene|day"
COUNTED = "bytes?|bits?|numbers?|scalars?|components?|floats?|samples?|fetch(?:es)?|once|twice|texels|tables?|rows?|images?|maps?|points?"


@dataclass(frozen=True)
class Rule:
    """A pattern, and what to write instead; `stems`: one of them, in lower case, is in whatever it finds."""

    pattern: re.Pattern[str]
    instead: str
    stems: tuple[str, ...] = ("",)

    def may_be_in(self, text: str, lowered: str) -> bool:
        """Whether any line may hold it: substrings are found far faster than patterns."""
        return any(stem in lowered for stem in self.stems) and self.pattern.search(text) is not None


def word(*forms: str, instead: str) -> Rule:
    """A rule for whole words, also as a part of an identifier: `lamp` in `lamp_table`, `lampTable`, `SrbfLamp` and `LAMPS`."""
    options = []
    for form in forms:
        title = form[0].upper() + form[1:]
        options += [rf"(?<![A-Za-z]){form}(?![a-z])", rf"{title}(?![a-z])", rf"(?<![A-Z]){form.upper()}(?![A-Za-z])"]
    return Rule(re.compile("|".join(options)), instead, forms)


def phrase(pattern: str, instead: str, *stems: str) -> Rule:
    """A rule for a regular expression, in any letter case."""
    return Rule(re.compile(pattern, re.IGNORECASE), instead, stems or ("",))


RULES = (
    # the field's terms
    word("lamp", "lamps", instead="point light"),
    word("answer", "answers", "answered", instead="response, result or returns"),
    word("sky", "skies", instead="environment, environment map or environment light"),
    phrase(r"\bscalar planes?\b", "coefficient maps, planes or components"),
    phrase(r"\bfar lights?\b", "distant lights"),
    phrase(r"\b(?:wall_)?tints?\b", "transmittance", "tint"),
    word("ripple", "ripples", instead="flicker"),
    word("ghosts", instead="ghosting"),
    phrase(r"\bpops\b", "popping"),
    phrase(r"\bsewn\b", "stitched"),
    phrase(rf"\b(?:{COUNTED}) an? (?:{UNITS})\b", "per, as in bytes per texel", " a ", " an "),
    # US spelling
    phrase(
        r"colour|grey(?![a-z])|behaviour|neighbour|licence|metres?\b|(?<!per)centre",
        "US spelling: color, gray, behavior, center, license, meter",
        *("colour", "grey", "behaviour", "neighbour", "licence", "metre", "centre"),
    ),
    phrase(r"\b(?:normal|organ|optim|initial|general|visual|quant)is(?:e[sd]?|ing|ation)\b", "US spelling: -ize", "ise", "isi", "isa"),
    # archaic or literary turns
    phrase(r"\bforet(?:old|ells?|elling)\b", "predict"),
    phrase(r"\bthereby\b|\bhitherto\b|\bwherein\b|\bthereof\b|\btherein\b", "a second sentence"),
    phrase(r"\bbears?\b", "has, supports or no longer fails on"),
    phrase(r"\blest\b", "so that … not"),
    phrase(r"\bwhilst\b", "while"),
    phrase(r"\bupon\b", "on"),
    phrase(r"\banew\b", "again"),
    phrase(r"\bbut for\b", "except"),
    phrase(r"\balike\b|\blikewise\b", "both, too or the same"),
    phrase(r"\bat hand\b", "available or current"),
    phrase(r"\bought to\b", "should"),
    phrase(r"\b(?:is|are|be|was) told\b|\btold apart\b|\bcan be told\b", "gets, or can be computed", "told"),
    phrase(
        r"\bstands? (?:about|beside|still|where|apart)\b|\bas (?:it|they) stands?\b", "surrounds, is beside, is static, unchanged", "stand"
    ),
    phrase(r"\bgo(?:es|ne)? on with\b|\bgoes on from\b", "resumes, extends"),
    phrase(r"\bdisarm(?:s|ed|ing)?\b", "disables the scripts"),
    phrase(r"\bmay know whom\b", "import rules"),
)

ALLOWED = (
    re.compile(r"[Cc]holesky"),
    re.compile(r"PanoramaSky|ProceduralSky|PhysicalSky|TexSky"),  # classes of Godot and Blender
    re.compile(r"[\"']?tint_by_cosine[\"']?"),  # a key of scene.glb on disk
    re.compile(r"[Ss]ky occlusion"),  # a feature of Unity
    re.compile(r"[\"']Desk lamp[\"']"),  # an object's name
)
NOT_SCANNED = (
    "CHANGELOG.md",  # records former names
    "scripts/check_words.py",
    "tests/docs/test_check_words.py",
)
NOT_YET: tuple[str, ...] = ()  # folders whose words are still to be mended

OWN_WORDS = {  # where a file is of an engine that has the word itself
    "engines/godot": re.compile(r"[Ss]ky|SKY"),
    "docs/engines": re.compile(r"[Ss]k(?:y|ies)"),
    "tests/export/godot_compare.gd": re.compile(r"sky"),
    "scripts/test_godot.py": re.compile(r"[Ss]ky|SKY"),
    "engines/unity": re.compile(r"Tint|MonoBehaviour|skies"),
    "tests/export/unity": re.compile(r"\w*Behaviour"),
}


@dataclass(frozen=True)
class Finding:
    """A word on a line of a file."""

    file: str
    line: int
    word: str
    instead: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.word!r}; write: {self.instead}"


def findings(file: str, text: str) -> Iterator[Finding]:
    """All words of RULES in a file's text, except on lines with the marker and in names of ALLOWED."""
    lowered = text.lower()
    rules = [rule for rule in RULES if rule.may_be_in(text, lowered)]
    if not rules:
        return
    for number, line in enumerate(text.splitlines(), 1):
        if MARKER in line:
            continue
        for place, own in OWN_WORDS.items():
            line = own.sub("", line) if file.startswith(place) else line
        for allowed in ALLOWED:
            line = allowed.sub("", line)
        for rule in rules:
            for found in rule.pattern.finditer(line):
                yield Finding(file, number, found[0], rule.instead)


def scanned(paths: Sequence[str] = ()) -> list[Path]:
    """The project's tracked text files, below `paths` if given; without NOT_YET otherwise."""
    listed = subprocess.run(["git", "ls-files", "-z", "--", *paths], cwd=ROOT, capture_output=True, text=True, check=True)
    names = [name for name in listed.stdout.split("\0") if Path(name).suffix in SUFFIXES or Path(name).name in NAMES]
    later = () if paths else NOT_YET
    kept = (name for name in names if name not in NOT_SCANNED and not any(name == part or name.startswith(f"{part}/") for part in later))
    return [ROOT / name for name in kept if (ROOT / name).is_file()]


def main(paths: Sequence[str]) -> int:
    """Print the findings; 1 where there are any."""
    found = [
        finding for path in scanned(paths) for finding in findings(path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8"))
    ]
    for finding in found:
        print(finding)
    return bool(found)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
