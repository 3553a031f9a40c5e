"""Every command that the documentation shows: the lines of its shell blocks, and the code spans that call a program or name a flag."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROGRAMS = ("srbf", "make", "python", "pip", "pytest", "blender", "npm", "npx", "dask", "openjd", "godot", "cd", "sh", "git")
PLACES = (".venv/bin/", "scripts/", "benchmarks/", "data/scenes/")  # of ours
SHELLS = ("sh", "bash", "console", "")  # a block that names no language is read as a shell's
ACTIVATION = ". .venv/bin/activate"
FENCE = re.compile(r"^\s*(?:[-*]|\d+\.)?\s*```(\S*)")  # a list's item may begin with one
SPAN = re.compile(r"(?<!`)`([^`]+)`(?!`)")
VARIABLE = re.compile(r"[A-Z_]+=.*")
ENVIRONMENT = re.compile(r"^\.venv[^/]*/bin/")


@dataclass(frozen=True)
class Command:
    """What stands on a line of a file, its comment cut off and its continuations joined."""

    file: str
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.text}"

    def saying(self, text: str) -> Command:
        """Other words in the same place."""
        return Command(self.file, self.line, text)

    @property
    def words(self) -> tuple[str, ...]:
        """As a shell splits them, variables before the program left out and the program without the path of its environment."""
        words = shlex.split(self.text)
        while words and VARIABLE.fullmatch(words[0]):
            words.pop(0)
        return (ENVIRONMENT.sub("", words[0]), *words[1:]) if words else ()

    @property
    def variables(self) -> dict[str, str]:
        """What the command sets for itself alone, as in `OUT=x make`."""
        found = {}
        for word in shlex.split(self.text):
            if not VARIABLE.fullmatch(word):
                break
            name, _, found[name] = word.partition("=")
        return found


@dataclass(frozen=True)
class Page:
    """What a page shows: blocks, which are scripts; calls, whole commands or mentions of one; flags, spans that begin with one."""

    blocks: list[tuple[Command, ...]]
    calls: list[Command]
    flags: list[Command]


def pages() -> list[Path]:
    """What is at the root and in docs/, and the READMEs of the parts; a changelog tells of the past."""
    found = {*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("*/README.md")}
    return sorted(path for path in found if path.name != "CHANGELOG.md" and not path.parent.name.startswith("."))


def read(path: Path) -> Page:
    """The commands of one of our pages."""
    return page_of(path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8"))


def page_of(file: str, text: str) -> Page:
    """The commands of a page's text; `file` is for messages."""
    blocks: list[list[Command]] = []
    prose: list[str] = []
    language: str | None = None  # of the block that the line is in
    for number, line in enumerate(text.splitlines(), 1):
        fence = FENCE.match(line)
        if fence:
            language = fence[1] if language is None else None
            if language in SHELLS:
                blocks.append([])
        elif language in SHELLS:
            _add(blocks[-1], Command(file, number, _without_comment(line)))
        prose.append("" if fence or language is not None else line)
    spans = list(_spans(file, "\n".join(prose)))
    calls = [span for span in spans if _is_call(span.text)]
    return Page([tuple(block) for block in blocks if block], calls, [span for span in spans if re.match(r"--?[a-z]", span.text)])


def _without_comment(line: str) -> str:
    return re.sub(r"(^|\s)#.*", "", line).strip().removeprefix("$ ")


def _add(block: list[Command], command: Command) -> None:
    if block and block[-1].text.endswith("\\"):
        block[-1] = block[-1].saying(f"{block[-1].text[:-1].rstrip()} {command.text}")
    elif command.text and command.text != ACTIVATION:
        block.append(command)


def _spans(file: str, prose: str) -> Iterator[Command]:
    """Code spans, which may go on over the end of a line, but not of a paragraph; a table writes | as \\|."""
    line = 1
    for paragraph in re.split(r"(\n\s*\n)", prose):
        for found in SPAN.finditer(paragraph):
            yield Command(file, line + paragraph.count("\n", 0, found.start()), " ".join(found[1].replace("\\|", "|").split()))
        line += paragraph.count("\n")


def _is_call(text: str) -> bool:
    words = [word for word in text.split() if not VARIABLE.fullmatch(word)]
    return len(words) > 1 and (words[0] in PROGRAMS or words[0].startswith(PLACES))
