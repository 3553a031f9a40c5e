"""What bakes under a cubemap tell of their receivers, one and several, without Blender."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from srbf.bake.cubemap_trace import totals
from srbf.bake.surface_checks import warn_of_duplicates, warn_of_unlit
from srbf.cubemap_transport import BOUNCES_FILE, VISIBILITY_FILE, write_arrays
from srbf.io import files
from srbf.receiver_images import MANIFEST


def stages(folder: Path, receivers: int, rays: int, sampled: float) -> Path:
    """The files of a capture that tell what it took: 1.5 s and 2 s."""
    folder.mkdir()
    write_arrays(folder / VISIBILITY_FILE, "made", receivers=np.arange(receivers), cpu_seconds=np.array(1.5))
    write_arrays(folder / BOUNCES_FILE, "made", cpu_seconds=np.array(2.0))
    files.write_json(folder / MANIFEST, {"cubemap": {"rays": rays, "sampled": sampled}})
    return folder


def test_totals_are_sums_over_all_receivers(tmp_path: Path) -> None:
    one, two = stages(tmp_path / "one", 30, 1000, 0.5), stages(tmp_path / "two", 10, 234, 0.1)
    assert totals([one]) == {"rays": 1000, "cpu_seconds": 3.5, "sampled": pytest.approx(0.5)}
    assert totals([one, two]) == {"rays": 1234, "cpu_seconds": 7.0, "sampled": pytest.approx(0.4)}
    assert totals([tmp_path / "none", two]) == totals([two]) and totals([tmp_path / "none"]) is None


def test_receivers_that_see_nothing_and_duplicates_have_a_line_each() -> None:
    starts = np.arange(15, dtype=np.float32).reshape(5, 3)
    normals = np.tile(np.array([0, 0, 1], np.float32), (5, 1))
    said: list[str] = []
    warn_of_unlit(np.ones(5, bool), "'Ball'", said.append)
    warn_of_duplicates(starts, normals, "'Ball'", said.append)
    warn_of_duplicates(starts[[0, 0]], np.array([[0, 0, 1], [1, 0, 0]], np.float32), "'Ball'", said.append)
    assert said == []
    warn_of_unlit(np.array([1, 1, 0, 1, 0], bool), "'Ball'", said.append)
    warn_of_duplicates(starts[[0, 1, 1, 2, 1]], normals, "'Ball'", said.append)
    assert [line.partition(":")[0] for line in said] == [
        "2 of 5 receivers of 'Ball' see nothing and stay black",
        "2 of 5 receivers of 'Ball' are where another is, with its normal",
    ]
