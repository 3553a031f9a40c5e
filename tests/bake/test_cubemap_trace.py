"""What bakes under a cubemap tell of several captures, without Blender."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from srbf.bake.cubemap_trace import totals
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
