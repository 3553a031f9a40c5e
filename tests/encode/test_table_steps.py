"""Tables as multiples of powers of two: what they lose, and that what shows less is coarser."""

from __future__ import annotations

import numpy as np

from srbf.encode.table_steps import COLUMN_ERROR, VALUE_STEP, steps_by_cluster, steps_by_column


def test_every_surfel_keeps_its_picture() -> None:
    rng = np.random.default_rng(0)
    shapes = np.geomspace(1, 1e-3, 200).astype(np.float32)
    transfer = (rng.normal(size=(200, 300, 3)) * rng.uniform(0.01, 10, (300, 1))).astype(np.float32)
    found = steps_by_column(transfer, shapes)
    size = shapes[:, None, None]
    off = np.sqrt((((found - transfer) * size) ** 2).sum(axis=(0, 2)) / ((transfer * size) ** 2).sum(axis=(0, 2)))
    assert off.max() < 1.5 * COLUMN_ERROR  # steps are the nearest powers of two
    np.testing.assert_array_equal(found, found.astype(np.float16))
    assert (found[-1] == 0).mean() > 0.9 > (found[0] == 0).mean(), "a shape that shows little needs few bits"
    steps = np.frexp(np.abs(found[0, 0])[found[0, 0] != 0])[0]
    np.testing.assert_array_equal(steps * 2**12, np.round(steps * 2**12))


def test_functions_of_a_cluster_share_a_step() -> None:
    functions = (np.random.default_rng(1).normal(size=(4, 5, 3)) * np.array([1, 1, 100, 100])[:, None, None]).astype(np.float16)
    found = steps_by_cluster(functions, 2).astype(np.float64)
    for own, before in ((found[:2], functions[:2]), (found[2:], functions[2:])):
        rms = np.sqrt((before.astype(np.float64) ** 2).mean())
        assert np.abs(own - before.astype(np.float64)).max() <= VALUE_STEP * rms
    assert not steps_by_cluster(np.zeros((2, 1, 1), np.float16), 1).any()
