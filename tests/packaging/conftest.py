"""The distributions as a user gets them: sdists of the checkout, wheels of the sdists, installed into an empty environment."""

from __future__ import annotations

import os
import sys
import venv
from pathlib import Path

import pytest
from environments import ROOT, Distribution, Environment, run, succeed


@pytest.fixture(scope="session")
def empty(tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """Python and pip alone."""
    environment = Environment(tmp_path_factory.mktemp("empty"), tmp_path_factory.mktemp("nowhere"))
    venv.create(environment.root, with_pip=True)
    return environment


def build(project: Path, folder: Path, empty: Environment) -> Distribution:
    """sdist of a folder of the checkout, then a wheel from the sdist alone, where no npm is."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])  # with npm, for a page that is not built yet
    succeed(run([sys.executable, "-m", "build", "--sdist", "--outdir", folder, project], path, folder))
    (sdist,) = folder.glob("*.tar.gz")
    succeed(empty.python("-m", "pip", "wheel", "--no-deps", "--wheel-dir", folder, sdist))
    (wheel,) = folder.glob("*.whl")
    return Distribution(sdist, wheel)


@pytest.fixture(scope="session")
def srbf_built(tmp_path_factory: pytest.TempPathFactory, empty: Environment) -> Distribution:
    return build(ROOT, tmp_path_factory.mktemp("srbf"), empty)


@pytest.fixture(scope="session")
def blender_built(tmp_path_factory: pytest.TempPathFactory, empty: Environment) -> Distribution:
    return build(ROOT / "blender_bake", tmp_path_factory.mktemp("srbf_blender"), empty)


@pytest.fixture(scope="session")
def installed(srbf_built: Distribution, tmp_path_factory: pytest.TempPathFactory, empty: Environment) -> Environment:
    """The wheel of srbf in an empty environment: no dependency may need a compiler."""
    environment = Environment(tmp_path_factory.mktemp("installed"), empty.nowhere)
    venv.create(environment.root, with_pip=True)
    succeed(environment.python("-m", "pip", "install", "--no-compile", "--only-binary", ":all:", srbf_built.wheel))
    return environment
