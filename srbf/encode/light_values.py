"""The functions of components at the captured lights, by least squares on the components as they are stored."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.capture import COVERED, Capture
from srbf.compute.threads import each, one_blas_thread

SMALLEST = 1e-9  # of the largest eigenvalue: directions of the components that hold nothing


def light_values(
    capture: Capture,
    components: Float32[ndarray, "S P"],
    index: Int[ndarray, " P"],
    clusters: int,
    progress: Callable[[int], None] = lambda images: None,
) -> Float32[ndarray, "F L 3"]:
    """w of the least sum over covered texels of |T(p, l) - w_{m,0}(l) - sum_j a_j(p) w_{m,j}(l)|^2, m the cluster of p; F = C (S + 1).

    One pass over the train images. Rounding of the components is made up for, and noise averages over the texels of a cluster. Clusters
    without covered texels are 0.
    """
    train = capture.indices("train")
    covered = np.flatnonzero(capture.coverage().ravel() >= COVERED)
    size = len(components) + 1
    members = [covered[index[covered] == number] for number in range(clusters)]
    designs = [np.concatenate([np.ones((1, len(own)), np.float32), components[:, own]]) for own in members]  # (S + 1, n)
    values = np.zeros((clusters, size, len(train), 3), np.float32)
    solvers = [_solver(design.astype(np.float64)) for design in designs]
    for first, block in capture.stream(train):

        def work(number: int, first: int = first, block: np.ndarray = block) -> None:
            own = members[number]
            if len(own):
                gathered = block[:, own].astype(np.float32)  # (b, n, 3)
                right = np.einsum("sn,bnc->sbc", designs[number], gathered, optimize=True)
                solved = solvers[number] @ right.reshape(size, -1)
                values[number, :, first : first + len(block)] = solved.reshape(right.shape)

        with one_blas_thread():
            each(work, clusters)
        progress(first + len(block))
    return values.reshape(clusters * size, len(train), 3)


def _solver(design: Float64[ndarray, "s n"]) -> Float64[ndarray, "s s"]:
    """The pseudoinverse of the normal equations' matrix."""
    return np.asarray(np.linalg.pinv(design @ design.T, rcond=SMALLEST, hermitian=True))
