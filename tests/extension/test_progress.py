"""The reader of a bake's progress, on streams cut anywhere; and a job that speaks, stops and fails."""

from __future__ import annotations

import importlib
import json
import signal
import sys
import time
import types
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

# The package itself imports bpy; these two modules of it do not, and are read here without it.
WITHOUT_BPY = "blender_extension_without_bpy"
sys.modules[WITHOUT_BPY] = types.ModuleType(WITHOUT_BPY)
sys.modules[WITHOUT_BPY].__path__ = [str(Path(__file__).parents[2] / "blender_extension")]
progress = importlib.import_module(f"{WITHOUT_BPY}.progress")
process = importlib.import_module(f"{WITHOUT_BPY}.process")

LINES = [
    '{"done": 1, "total": 8, "what": "light 1 of 4", "seconds_left": 12.5}',
    "srbf: made a lightmap UV layer",
    '{"done": 4.5, "total": 8, "what": "light 2 of 4", "seconds_left": null}',
    '{"event": "scene"}',
    "{not JSON",
    "[1, 2]",
]
STREAM = "\n".join(LINES).encode() + b"\n"


@given(st.lists(st.integers(0, len(STREAM)), max_size=12))
def test_a_stream_reads_alike_however_it_is_cut(cuts) -> None:
    reader = progress.Reader()
    edges = [0, *sorted(cuts), len(STREAM)]
    for begin, end in zip(edges, edges[1:], strict=False):
        reader.feed(STREAM[begin:end])
    assert reader.progress == progress.Progress(4.5, 8, "light 2 of 4", None)
    assert reader.words == [LINES[1], *LINES[3:]]


def test_half_a_line_waits_for_its_end() -> None:
    reader = progress.Reader()
    reader.feed(LINES[0].encode())
    assert reader.progress is None
    reader.close()
    assert reader.progress == progress.Progress(1, 8, "light 1 of 4", 12.5)


@pytest.mark.parametrize(
    "line",
    [
        "",
        "null",
        "3",
        '{"done": 1}',
        '{"done": "1", "total": 2}',
        '{"done": NaN, "total": 2}',
        '{"done": true, "total": 2}',
        '{"done": 1, "total"',
    ],
)
def test_what_is_no_progress(line) -> None:
    assert progress.parse(line) is None


def test_fractions_stay_between_0_and_1() -> None:
    told = [progress.parse(json.dumps({"done": done, "total": total})) for done, total in ((-1, 4), (1, 4), (9, 4), (0, 0))]
    assert [p.fraction for p in told] == [0, 0.25, 1, 0]
    assert progress.parse('{"done": 1, "total": 2, "seconds_left": -3}').seconds_left is None


def test_durations() -> None:
    assert [progress.duration(s) for s in (0.2, 59.5, 61, 3600, 11100)] == ["1 s", "60 s", "2 min", "1 h 00 min", "3 h 05 min"]


def test_words_are_not_kept_without_end() -> None:
    reader = progress.Reader()
    reader.feed(b"".join(b"line %d\n" % i for i in range(1000)))
    assert len(reader.words) == progress.WORDS_KEPT
    assert reader.words[-1] == "line 999"


SPEAKS = "import json, sys; print(json.dumps({'done': 1, 'total': 2}), file=sys.stderr, flush=True);"
STOPS = (
    "import signal, time; {speaks} \ntry: time.sleep(30)\nexcept KeyboardInterrupt: print('srbf: stopped', file=sys.stderr); sys.exit(1)"
)


def ended(job, until=lambda job: False):
    deadline = time.monotonic() + 20
    while job.poll() and not until(job):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return job


def test_a_job_is_heard_and_ends(tmp_path) -> None:
    job = ended(process.Job("Bake", [sys.executable, "-c", SPEAKS], tmp_path / "made" / "log"))
    assert (job.status, job.reader.progress.fraction, job.outcome()) == (0, 0.5, "Bake: done")


def test_a_job_that_is_stopped_ends_by_itself(tmp_path) -> None:
    job = process.Job("Bake", [sys.executable, "-c", STOPS.format(speaks=SPEAKS)], tmp_path / "log")
    ended(job, until=lambda job: job.reader.progress is not None)
    assert job.running
    job.stop()
    ended(job)
    assert (job.status, job.reader.words, job.outcome()) == (1, ["srbf: stopped"], "Bake: stopped")


def test_a_stop_reaches_the_host_where_blender_ignores_ctrl_c(tmp_path, monkeypatch) -> None:
    """As it does when a shell's script began it in the background; children inherit that."""
    (tmp_path / "srbf").mkdir()
    (tmp_path / "srbf" / "__init__.py").touch()
    (tmp_path / "srbf" / "__main__.py").write_text(
        "import sys, time\n"
        "def main():\n"
        "    print('srbf: baking', flush=True)\n"
        "    try: time.sleep(30)\n"
        "    except KeyboardInterrupt: sys.exit('srbf: stopped')\n"
    )
    monkeypatch.setattr(process, "environment", lambda extensions: {"PYTHONPATH": str(tmp_path)})
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        job = process.Job("Bake", process.host_command([]), tmp_path / "log")
    finally:
        signal.signal(signal.SIGINT, before)
    ended(job, until=lambda job: job.reader.words)
    job.stop()
    ended(job)
    assert job.reader.words[-1] == "srbf: stopped"


@pytest.mark.slow
def test_a_job_that_fails_says_why(tmp_path) -> None:
    job = ended(process.Job("Fit", process.host_command(["fit", str(tmp_path / "none"), "-o", str(tmp_path / "asset")]), tmp_path / "log"))
    assert job.status == 1
    assert job.outcome().startswith("Fit: expected a capture with a capture.json at")


def test_the_bakes_blender_is_kept_from_the_users_extensions(tmp_path) -> None:
    """Started with factory settings it would remove the wheels of all that are installed, the library's among them."""
    tell = "import os; folder = os.environ['BLENDER_USER_EXTENSIONS']; print(folder, os.listdir(folder))"
    job = ended(process.Job("Bake", [sys.executable, "-c", tell], tmp_path / "log"))
    folder, held = job.reader.words[0].split()
    assert held == "[]"
    assert not Path(folder).exists()
