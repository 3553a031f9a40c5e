"""Every command that the documentation shows is run here, or by a test that is named in `tables.py`; what is new and wrong fails."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from classes import NobodyRunsIt, asked_for, class_of, fits_some_command, steps
from documented import ROOT, Command, page_of, pages, read
from named_parts import wrong_in
from npm_package import npm
from tables import ELSEWHERE
from workplace import Workplace, prepare

from srbf.cli.flags import FORMER_FLAGS
from srbf.viewer.built_page import FILES
from srbf.viewer.built_page import ROOT as PAGE

__all__ = ["npm"]  # a fixture
PAGES = [read(path) for path in pages()]
BLOCKS = [block for page in PAGES for block in page.blocks]
SHOWN = {command.text for block in BLOCKS for command in block}
CALLS = list({call.text: call for page in PAGES for call in page.calls if call.text not in SHOWN}.values())  # each once
SCRIPTS = [*BLOCKS, *((call,) for call in CALLS)]


def is_script(commands: tuple[Command, ...]) -> bool:
    return commands in BLOCKS


def classes(commands: tuple[Command, ...]) -> list[str]:
    """The class of each step of a block, or of a lone call; of what has none, that it is unknown: the test of classes says more."""
    found = []
    for command in commands:
        try:
            found += [class_of(step, is_script(commands)) for step in steps(command)]
        except NobodyRunsIt:
            found.append("unknown")
    return found


def named(commands: tuple[Command, ...], **marks: bool) -> object:
    text = commands[0].text if len(commands) == 1 else f"{commands[0].text} ..."
    chosen = [getattr(pytest.mark, name) for name, given in marks.items() if given]
    return pytest.param(commands, id=f"{commands[0].file}:{commands[0].line}: {text}", marks=chosen)


def wants_a_page(commands: tuple[Command, ...]) -> bool:
    """Whether node has to build something first."""
    return any(re.search(r"\bsrbf view|--target web|\bnpm|--view", command.text) for command in commands)


def to_run() -> list[tuple[Command, ...]]:
    """The scripts with something to be run here, less the lone commands that ask for what one before has asked for."""
    found, asked = [], set()
    for commands in (commands for commands in SCRIPTS if "run" in classes(commands)):
        runs = {asked_for(step) for command in commands for step in steps(command) if class_of(step, is_script(commands)) == "run"}
        if is_script(commands) or runs - asked:
            found.append(commands)
        asked |= runs
    return found


RUN = to_run()


@pytest.fixture(scope="session")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("documented")
    prepare(folder)
    return folder


@pytest.mark.parametrize("commands", [named(commands, blender=True, engines=wants_a_page(commands)) for commands in RUN])
def test_it_runs(commands: tuple[Command, ...], prepared: Path, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    if wants_a_page(commands):
        run_npm: Callable[..., str] = request.getfixturevalue("npm")
        if not all((PAGE / name).is_file() for name in FILES):
            run_npm("run", "build:viewer")
    place = Workplace(shutil.copytree(prepared, tmp_path / "place"))
    for command in commands:
        for step in steps(command):
            if class_of(step, is_script(commands)) == "run":
                assert (said := place.failure_of(step)) is None, f"{step}\n  {said}"


@pytest.mark.parametrize("commands", [named(commands) for commands in SCRIPTS])
def test_somebody_runs_it(commands: tuple[Command, ...]) -> None:
    for command in commands:
        for step in steps(command):
            if class_of(step, is_script(commands)) != "run":
                assert (wrong := wrong_in(step)) is None, f"{command}\n  in {step.text}: {wrong}"


@pytest.mark.lengthy
def test_flags_that_are_named_exist() -> None:
    unknown = [str(flag) for page in PAGES for flag in page.flags if not fits_some_command(flag)]
    assert not unknown, "no command and no script of ours takes:\n" + "\n".join(unknown)


@pytest.mark.parametrize("who", sorted(set(ELSEWHERE.values())))
def test_who_is_said_to_run_it_exists(who: str) -> None:
    file, _, name = who.partition("::")
    assert re.search(rf"^def {name}\(", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE), f"tests/docs/tables.py names {who}"


EXAMPLE = """
Try `srbf info asset`, or `srbf fit` with
`--k 3 \\| 4`, as `srbf fit CAPTURE
-o ASSET` does, `here`.

1. ```js
   `srbf nothing`
   ```
```sh
. .venv/bin/activate
# a comment
srbf fit capture \\
    -o asset   # another
make demo && cd web
```
"""


def test_what_is_taken_for_a_command() -> None:
    page = page_of("x.md", EXAMPLE)
    assert [str(command) for block in page.blocks for command in block] == [
        "x.md:12: srbf fit capture -o asset",
        "x.md:14: make demo && cd web",
    ]
    assert [str(call) for call in page.calls] == ["x.md:2: srbf info asset", "x.md:2: srbf fit", "x.md:3: srbf fit CAPTURE -o ASSET"]
    assert [str(flag) for flag in page.flags] == ["x.md:3: --k 3 | 4"]


@pytest.mark.parametrize(
    ("text", "script", "expected"),
    [
        ("srbf fit capture -o asset -k 25", True, "run"),
        ("srbf fit -k 25", False, "mention"),
        ("srbf fit -k 25", True, "lacks an argument"),
        ("srbf fit capture -o asset --maps 25", True, "refuses it"),
        ("srbf fit --method fourier", False, "refuses it"),
        ("srbf paint capture", False, "srbf has no command paint"),
        ("python -m http.server", True, "nobody runs this"),
        ("npm run dance", True, "nobody runs this"),
        ("make supper", True, "make refuses it"),
        ("dask scheduler", True, "elsewhere"),
    ],
)
def test_a_command_has_one_class_or_fails(text: str, script: bool, expected: str) -> None:
    command = Command("x.md", 7, text)
    try:
        found = [class_of(step, script) for step in steps(command)]
    except NobodyRunsIt as error:
        assert expected in str(error) and f"x.md:7: {text}" in str(error)
    else:
        assert found == [expected]


def test_no_command_is_shown_with_a_former_flag() -> None:
    commands = [command for page in PAGES for command in (*page.calls, *(step for block in page.blocks for step in block))]
    ours = [command for command in commands if command.words and command.words[0] == "srbf"]
    assert len(ours) > 50
    assert [str(command) for command in ours if {word.partition("=")[0] for word in command.words} & set(FORMER_FLAGS)] == []
