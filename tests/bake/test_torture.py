"""A short share of `make torture`: each fault a few times, and that the torture itself notices a loss."""

from __future__ import annotations

import os
import sys

import faults
import numpy as np
import pytest
import torture

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="looks for workers in /proc")]
TRIALS = 2


@pytest.fixture(scope="module")
def labs(tmp_path_factory: pytest.TempPathFactory) -> torture.Labs:
    # The processes that run the command are forked from one that has its libraries, without the checks of annotations.
    path = [str(torture.HERE), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join(part for part in path if part))
        return torture.Labs(tmp_path_factory.mktemp("torture"))


@pytest.mark.parametrize(
    "row",
    [
        torture.killed_at_every_write,
        torture.killed_while_replacing,
        torture.disk_full_at_every_write,
        torture.damaged_files,
        torture.dying_workers,
        torture.lying_workers,
        torture.stale_leavings,
        pytest.param(torture.interrupted, marks=pytest.mark.blender),
    ],
    ids=lambda row: row.__name__,
)
def test_nothing_is_lost(labs: torture.Labs, row) -> None:
    trials = row(labs, np.random.default_rng(1))
    for _ in range(TRIALS):
        next(trials)()


def test_a_loss_is_noticed(labs: torture.Labs) -> None:
    """A light taken away behind the bake's back once it has ended, a texel changed, a file left over."""
    lab = labs.fake()
    whole = dict(lab.whole)
    faults.compare(whole, lab.whole)
    for spoil in (
        lambda files: files.pop("lights/0001.exr"),
        lambda files: files.update({"lights/0001.exr": files["lights/0002.exr"]}),
        lambda files: files.update({"left.over": b""}),
    ):
        spoiled = dict(whole)
        spoil(spoiled)
        with pytest.raises(faults.LostError, match="0001|left.over"):
            faults.compare(spoiled, lab.whole)


def test_every_file_operation_is_struck(labs: torture.Labs) -> None:
    """The n-th kill comes for every n up to the count, and no later: no operation goes uncounted."""
    lab = labs.fake()
    assert lab.operations > 50
    for n, status in ((1, -9), (lab.operations, -9), (lab.operations + 10, 0)):
        folder = lab.fresh()
        assert lab.run(folder, strike=faults.Strike("kill", n, folder)).status == status
