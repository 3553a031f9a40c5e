"""Commands on the scenes of light_set_scenes.py, and the names of their lights."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from building import FEW, built
from typer.testing import CliRunner, Result

from srbf.cli import app

NAMES = ["Bulb, left=1", "Fenêtre/№ 2", "Panel", "Tall  Screen"]  # as ODD_NAMES, and the panel


def srbf(*words: object) -> Result:
    """The command line in this process; bakes run in a worker's."""
    return CliRunner().invoke(app, [str(word) for word in words])


def done(*words: object) -> Result:
    result = srbf(*words)
    assert result.exit_code == 0, (result.output, result.exception)
    return result


def of_a_process(*words: object, few: Mapping[str, int] = FEW) -> list[str]:
    """The same command line for a process that can be killed."""
    lines = [f"import srbf.{name.rpartition('.')[0]}; srbf.{name} = {value}" for name, value in few.items()]
    return [sys.executable, "-c", "; ".join([*lines, "from srbf.cli import app", "app()"]), *map(str, words)]


def refused(words: list[object], status: int = 1) -> str:
    """The one line of a command that fails."""
    result = srbf(*words)
    (line,) = [line for line in result.stderr.splitlines() if ": expected" in line or "cannot" in line]
    assert result.exit_code == status and "Traceback" not in result.output, result.output
    return line


def scenes_in(factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The .blend of a scene of light_set_scenes.py."""
    return built("../../tests/bake/light_set_scenes.py", factory)
