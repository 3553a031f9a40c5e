"""What tests of one engine share."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from unity_programs import Said, compiled
from unreal_stand_in import StandIn


@pytest.fixture(scope="session")
def ask(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Path, list[float]], Said]:
    """What the engine-free C# says of an exported folder and of lights as numbers."""
    return compiled(tmp_path_factory.mktemp("mono") / "responses.exe")


@pytest.fixture
def stand_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[StandIn]:
    module = StandIn(tmp_path / "Project")
    monkeypatch.setitem(sys.modules, "unreal", module)
    yield module
