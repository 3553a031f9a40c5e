"""What all tests share: captures with known responses, marks, and on request run-time checks of every annotation in srbf."""

from __future__ import annotations

import importlib.util
import os
import pkgutil
import signal
import sys
from collections.abc import Callable, Generator, Iterator
from functools import partial
from pathlib import Path

# Before numpy loads: one thread per test process for BLAS, OpenMP and Mesa's software renderer, or the processes of -n wait for each other.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "LP_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import numpy as np  # noqa: E402
import pytest  # noqa: E402

sys.path.insert(0, str(Path(__file__).parent))

# Begun in the background of a script, Python ignores Ctrl-C, and so would the processes that tests interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).parent.parent / "srbf"
CHECKS_ANNOTATIONS = bool(os.environ.get("SRBF_CHECK_ANNOTATIONS"))
if CHECKS_ANNOTATIONS:
    # Before srbf is first imported: shapes and dtypes of every annotated function are checked in all tests of this process. Not the
    # commands: typer reads their annotations its own way.
    import annotation_checks

    parts = [module.name for module in pkgutil.iter_modules([str(ROOT)])]
    annotation_checks.install([f"srbf.{part}" for part in parts if part not in ("cli", "__main__")])

from forked_blender import loaded  # noqa: E402
from made_assets import build_asset, build_planes  # noqa: E402
from made_captures import write_capture  # noqa: E402

from srbf.asset import Asset  # noqa: E402
from srbf.capture import Capture  # noqa: E402
from srbf.encode import light_function_fit, model_selection, position_table  # noqa: E402
from srbf.export import loss  # noqa: E402
from srbf.methods import relighting_map  # noqa: E402

OTHER_LANGUAGES = ("web/", "viewer/", "export/test_translation", "export/test_unity", "export/test_unreal")  # below tests/
LONGEST = "docs/test_documented_commands.py"  # of the files, each of which one process of -n runs


def pytest_configure(config: pytest.Config) -> None:
    if CHECKS_ANNOTATIONS:
        config.addinivalue_line("filterwarnings", "ignore:Method pygltflib:DeprecationWarning")  # annotations that are not ours


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what compiles other languages, or drives a browser: minutes in all; without bpy, skip what needs it. The longest file first."""
    here = Path(__file__).parent
    lacks_blender = importlib.util.find_spec("bpy") is None
    for item in items:
        if lacks_blender and item.get_closest_marker("blender"):
            item.add_marker(pytest.mark.skip(reason="this Python has no bpy"))
        if item.path.is_relative_to(here) and item.path.relative_to(here).as_posix().startswith(OTHER_LANGUAGES):
            item.add_marker(pytest.mark.engines)
    items.sort(key=lambda item: item.path != here / LONGEST)


STARTED = pytest.StashKey[float]()
LONG = 2.0  # s of processor time, which other work on the machine hardly stretches


def processor_time() -> float:
    """Of this process and of its ended children, s."""
    return sum(os.times()[:4])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    item.stash[STARTED] = processor_time()
    if CHECKS_ANNOTATIONS:
        annotation_checks.next_test()
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if call.when == "teardown" and not any(item.get_closest_marker(name) for name in ("slow", "blender", "engines")):
        report.user_properties.append(("seconds", round(processor_time() - item.stash[STARTED], 2)))
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name the tests that take long, the making of what they share included, and are not marked so."""
    seconds = {report.nodeid: dict(report.user_properties).get("seconds", 0.0) for report in terminalreporter.getreports("")}
    if long := sorted(((spent, test) for test, spent in seconds.items() if spent > LONG), reverse=True):
        terminalreporter.section(f"more than {LONG:g} s of processor time, and not marked slow")
        for spent, test in long:
            terminalreporter.write_line(f"{spent:6.1f} s  {test}")


@pytest.fixture(scope="session", autouse=True)
def coarse_tables_of_places_and_losses() -> Iterator[None]:
    """Of few nodes: each asks a method for the weights of a light, and thousands take seconds. Of few lights, for each export."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(position_table, "MOST_NODES", 128)
        patch.setattr(loss, "LIGHTS", 12)
        yield


SELECTION: dict[tuple[object, str], object] = {
    (light_function_fit, "SPREADS"): (0.7, 1.42, 2.0),
    (light_function_fit, "NARROW"): (0.7,),
    (light_function_fit, "WIDE"): (2.0,),
    (light_function_fit, "WIDE_SHARES"): (0.99,),
    (relighting_map, "spread_candidates"): partial(model_selection.spread_candidates, factors=model_selection.SPREADS[::4]),
}
SHIPPED = {(where, name): getattr(where, name) for where, name in SELECTION}


@pytest.fixture(scope="session", autouse=True)
def few_candidates() -> Iterator[None]:
    """A fit chooses among few kernels and spreads, the usual ones included: all take most of the time of a small fit."""
    with pytest.MonkeyPatch.context() as patch:
        for (where, name), few in SELECTION.items():
            patch.setattr(where, name, few)
        yield


@pytest.fixture
def every_candidate(few_candidates: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """As shipped, for tests of what is chosen."""
    for (where, name), every in SHIPPED.items():
        monkeypatch.setattr(where, name, every)


@pytest.fixture(scope="session", autouse=True)
def one_loaded_blender() -> Iterator[None]:
    """Workers of bakes that run in the test's process are forked from one that has loaded Blender once."""
    with pytest.MonkeyPatch.context() as patch:
        if sys.platform == "linux":  # other systems' libraries do not survive a fork
            patch.setattr("srbf.bake.worker.subprocess", loaded())
        yield


@pytest.fixture(scope="session")
def make_planes() -> Callable[..., Asset]:
    return build_planes


@pytest.fixture(scope="session")
def make_asset() -> Callable[..., Asset]:
    return build_asset


@pytest.fixture
def make_capture(tmp_path: Path) -> Callable[..., Capture]:
    """Write a capture whose images are given by a function of the light direction."""
    return lambda response, *, name="capture", **options: write_capture(tmp_path / name, response, **options)


@pytest.fixture(scope="session")
def plane_positions() -> np.ndarray:
    """World positions of a 10 x 14 lightmap of the square [-1, 1]^2 at z = 0, row 0 at y = +1; not to be written to."""
    height, width = 10, 14
    x = -1 + 2 * (np.arange(width) + 0.5) / width
    y = 1 - 2 * (np.arange(height) + 0.5) / height
    positions = np.zeros((height, width, 3), np.float32)
    positions[..., 0], positions[..., 1] = x[None, :], y[:, None]
    positions.flags.writeable = False
    return positions
