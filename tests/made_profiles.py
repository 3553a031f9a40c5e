"""Profiles for tests: tables of closed form, an uneven IES file, a picture with a different color in each corner."""

from __future__ import annotations

import numpy as np

from srbf.light_profile import Profile


def by_polar(values: np.ndarray) -> Profile:
    """Gray, axially symmetric: values at equal steps of the angle from the axis."""
    return Profile(np.repeat(np.asarray(values, np.float32)[:, None, None], 3, axis=2))


def ies_text(
    vertical: list[float], horizontal: list[float], candela: list[list[float]], factors: str = "1 1 100", multiplier: float = 1
) -> str:
    rows = "\n".join(" ".join(f"{value:g}" for value in row) for row in candela)
    numbers = f"1 1000 {multiplier:g} {len(vertical)} {len(horizontal)} 1 2 0 0 0\n{factors}"
    angles = "\n".join(" ".join(map(str, row)) for row in (vertical, horizontal))
    return f"IESNA:LM-63-2002\n[TEST] none\n[MANUFAC] none\nTILT=NONE\n{numbers}\n{angles}\n{rows}\n"


UNEVEN = ies_text(
    [0, 20, 40, 60, 90, 180],
    list(range(0, 361, 30)),
    [
        [500 * np.exp(-((v / 50) ** 2)) * (1.2 + (v > 0) * np.cos(np.radians(h - 40))) * (v < 180) for v in (0, 20, 40, 60, 90, 180)]
        for h in range(0, 361, 30)
    ],
)
uneven = Profile.of_ies(UNEVEN.encode(), "uneven.ies")


def picture(size: int = 16) -> np.ndarray:
    """(size, size, 3): red grows to the right, green downward, blue in the upper left quarter."""
    steps = np.linspace(0.1, 1, size)
    image = np.stack([np.tile(steps, (size, 1)), np.tile(steps[:, None], (1, size)), np.full((size, size), 0.2)], axis=2)
    image[: size // 2, : size // 2, 2] = 1
    return image.astype(np.float32)
