"""Functions of tests that need Blender, each in a process of its own: what one does to its scene, no other sees.

`python bpy_process.py FILE.py FUNCTION ARGUMENTS.json OUT.npz` calls a function of a test module and writes the arrays that it returns.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from forked_blender import loaded

ROOT = Path(__file__).parents[2]


def in_blender(function: Callable[..., dict[str, Any]], *arguments: Any) -> dict[str, np.ndarray]:
    """What `function` of a test module returns, by name, called with JSON `arguments` in a new process."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.npz"
        ours = [folder for folder in sys.path if Path(folder).is_relative_to(ROOT) and "site-packages" not in folder]
        found = {"PYTHONPATH": os.pathsep.join(ours)}  # what the test's module finds, it finds here
        done = run(Path(__file__), function.__code__.co_filename, function.__name__, json.dumps(arguments), out, **found)
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
        with np.load(out) as arrays:
            return dict(arrays)


def run(script: Path, *arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """`python SCRIPT ARGUMENTS` where Blender, pytest and srbf are loaded already."""
    if sys.platform == "linux":
        return loaded("pytest", "srbf.bake.run").run(script, *arguments, **environment)
    command = [sys.executable, str(script), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, env={**os.environ, **environment})


def main(file: str, function: str, arguments: str, out: str) -> None:
    """Call the function in this process."""
    sys.path[:0] = [str(ROOT), str(Path(file).parent)]
    spec = importlib.util.spec_from_file_location(Path(file).stem, file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    np.savez(out, **getattr(module, function)(*json.loads(arguments)))


if __name__ == "__main__":
    main(*sys.argv[1:])
    from blender_bake.ipc import leave

    sys.stdout.flush()
    leave(0)
