"""`python every_scene.py SCRIPT.py FOLDER`: all scenes of a script of data/scenes, each from Blender's empty file as if alone."""

from __future__ import annotations

import os
import runpy
import sys
from pathlib import Path


def main(script: str, folder: str) -> None:
    """Call the script as a user does, once for each scene."""

    def end(status: int) -> None:
        raise SystemExit(status)

    sys.path.insert(0, str(Path(script).parent))
    leave, os._exit = os._exit, end  # type: ignore[assignment]
    for name in runpy.run_path(script)["SCENES"]:
        sys.argv = [script, name, str(Path(folder) / f"{name}.blend")]
        try:
            runpy.run_path(script, run_name="__main__")
        except SystemExit as ended:
            if ended.code:
                raise
    leave(0)


if __name__ == "__main__":
    main(*sys.argv[1:])
