"""Methods are found by name: a module of srbf.methods with METHOD is one, and nothing else lists them."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import srbf.methods
from srbf import registry
from srbf.cli import method_flags
from srbf.errors import InputError

ROOT = Path(srbf.methods.__file__).parents[1]
ANOTHER = '''
"""A method in a file of its own."""
from dataclasses import dataclass
from typing import ClassVar

from srbf.methods.eigen_map import EigenMap
from srbf.methods.protocol import setting


@dataclass(frozen=True)
class Hologram(EigenMap):
    name: ClassVar[str] = "hologram"
    order: ClassVar[int] = 9
    implied_by: ClassVar[tuple[str, ...]] = ("fringes",)

    fringes: int = setting(7, "How many fringes.")


METHOD = Hologram
'''


@pytest.fixture
def another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    (tmp_path / "hologram.py").write_text(ANOTHER)
    monkeypatch.setattr(srbf.methods, "__path__", [*srbf.methods.__path__, str(tmp_path)])
    for found in (registry.method_named, registry.all_methods):
        found.cache_clear()
    yield
    sys.modules.pop("srbf.methods.hologram", None)
    for found in (registry.method_named, registry.all_methods):
        found.cache_clear()


def test_methods_are_listed_from_the_simplest() -> None:
    of_directions, inside = (
        ("relighting-map", "eigen-map", "clustered-eigen-map"),
        (
            "light-mix",
            "light-cloud",
            "named-maps",
            "glossy-cloud",
            "transfer",
            "deep-framebuffer",
            "gather-samples",
            "glossy-eigen-map",
            "neural-map",
            "transfer-paper",
        ),
    )
    assert registry.method_names() == (*of_directions, *inside)
    own = {path.stem for path in (ROOT.parent / "web" / "src" / "methods").glob("*.ts")} - {"index", "method", "node_kit"}
    assert own == {method.stem() for method in registry.all_methods() if method.on_page}, "what the page shows"
    assert [registry.method_named(name).name for name in registry.method_names()] == list(registry.method_names())


@pytest.mark.parametrize("name", registry.method_names())
def test_a_choice_is_told_in_words(name: str) -> None:
    assert not set("()=`") & set(str(registry.method_named(name)()))


@pytest.mark.usefixtures("another")
def test_another_file_is_another_method_with_its_flags() -> None:
    assert registry.method_names()[-1] == "hologram" and registry.method_named("hologram").settings()[-1] == "fringes"
    assert "fringes" in method_flags._flags()


@pytest.mark.parametrize("name", ["hologram", "protocol", "coefficient-maps", "../eigen_map", ""])
def test_what_is_no_method_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="relighting-map, eigen-map, clustered-eigen-map"):
        registry.method_named(name)


@pytest.mark.parametrize("name", registry.method_names())
def test_a_method_is_named_in_its_own_file_alone(name: str) -> None:
    naming = re.compile(rf"[\"']{name}[\"'](?!\s*:)")  # keys of JSON are no names
    files = [path for ending in ("*.py", "*.json") for path in ROOT.rglob(ending) if naming.search(path.read_text(encoding="utf-8"))]
    assert [path.relative_to(ROOT).as_posix() for path in files] == [f"methods/{name.replace('-', '_')}.py"]
