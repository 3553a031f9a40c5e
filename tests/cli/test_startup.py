"""What a command imports before it works: nothing that it may not need. Modules are counted, since times differ by machine."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from srbf.cli import COMMANDS

LIBRARIES = (
    "numpy",
    "pydantic",
    "scipy",
    "OpenImageIO",
    "jsonschema",
    "rich",
    "sklearn",
    "embreex",
    "moderngl",
    "dask",
    "PIL",
    "jaxtyping",
)


def imported(*arguments: object) -> set[str]:
    """The modules that `srbf` with these arguments has imported when it ends."""
    code = (
        "import sys\n"
        "from srbf.__main__ import main\n"
        "try:\n    main()\n"
        "except SystemExit as ended:\n    assert not ended.code, ended.code\n"
        "sys.stderr.write('\\nmodules: ' + ' '.join(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code, *map(str, arguments)], capture_output=True, text=True, check=True)
    return set(done.stderr.rpartition("modules: ")[2].split())


@pytest.mark.parametrize("flag", ["--help", "--version"])
def test_the_list_of_commands_imports_no_command_and_no_library(flag: str) -> None:
    modules = imported(flag)
    assert not modules & set(LIBRARIES)
    assert {name for name in modules if name.startswith("srbf")} <= {
        "srbf", "srbf.__main__", "srbf.errors", "srbf.cli", "srbf.cli.group", "srbf.cli.flags", "srbf.cli.terminal",
    }  # fmt: skip


@pytest.mark.lengthy
@pytest.mark.parametrize("command", COMMANDS)
def test_help_imports_numpy_at_most(command: str) -> None:
    assert not imported(command, "--help") & set(LIBRARIES[1:])


@pytest.mark.lengthy
def test_fit_and_info_leave_out_what_they_do_not_need(make_capture, tmp_path: Path) -> None:
    capture = make_capture(lambda d: np.full((4, 5, 3), max(0, d[2])), lights=8)
    modules = imported("fit", capture.folder, "-o", tmp_path / "asset", "-k", 4)
    assert not modules & {"embreex", "moderngl", "sklearn", "scipy.stats", "dask", "PIL"}
    assert not imported("info", tmp_path / "asset") & {"scipy", "rich.progress", "embreex", "moderngl", "sklearn", "dask", "PIL"}
