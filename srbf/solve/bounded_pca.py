"""Principal components of numbers of which only bounds matter: anything between a low and a high is as good."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.solve.pca import principal_axes


def bounded_pca(
    start: Float32[ndarray, "n D"],
    low: Float32[ndarray, "n D"],
    high: Float32[ndarray, "n D"],
    count: int,
    rounds: int,
    largest: float,
) -> tuple[Float32[ndarray, " D"], Float32[ndarray, "count D"], Float32[ndarray, "n count"]]:
    """(mean, axes, coefficients): mean + coefficients @ axes is between `low` and `high` where `count` axes can have it so.

    Minimizes the sum of Huber's function of the distance from [low, high] by majorization: each round, the target of every number is its
    approximation, moved towards the bounds by that distance or `largest`, and the components are those of the targets [Mazumder2010]; the
    rounds are accelerated [Nesterov1983], and the axes move by one step of subspace iteration in each [Halko2011].

    Parameters
    ----------
    start
        Numbers within the bounds; the first components are theirs.
    low, high
        -inf or inf where there is no bound.
    count
        How many axes; those beyond n - 1 are 0, and the result is then `start`.
    rounds
        4 n D count flops each.
    largest
        Distance beyond which errors count in proportion, not squared: outliers do not lead.

    Returns
    -------
    tuple
        Axes are orthonormal rows.

    Examples
    --------
    >>> from srbf.solve.bounded_pca import bounded_pca
    >>> numbers = np.random.default_rng(0).normal(size=(4, 9)).astype(np.float32)
    >>> mean, axes, found = bounded_pca(numbers, numbers, numbers, 3, 5, 1.0)
    >>> bool(np.allclose(mean + found @ axes, numbers, atol=1e-5))
    True
    """
    points, size = start.shape
    found = min(count, points - 1, size)
    mean = start.mean(axis=0)
    axes = principal_axes(start - mean, found)[0] if found else np.zeros((0, size), np.float32)
    scores = (start - mean) @ axes.T
    if 0 < found < points - 1:
        left = np.linalg.qr(scores)[0]
        now = before = mean + scores @ axes
        momentum = 1.0
        for _ in range(rounds):
            following = (1 + np.sqrt(1 + 4 * momentum**2)) / 2
            ahead = now + np.float32((momentum - 1) / following) * (now - before)
            momentum = following
            target = ahead + np.clip(np.clip(ahead, low, high) - ahead, -largest, largest)
            mean = target.mean(axis=0)
            target -= mean
            axes = np.linalg.qr(target.T @ left)[0].T
            scores = target @ axes.T
            left = np.linalg.qr(scores)[0]
            before, now = now, mean + scores @ axes
    whole, own = np.zeros((count, size), np.float32), np.zeros((points, count), np.float32)
    whole[:found], own[:, :found] = axes, scores
    return mean, whole, own
