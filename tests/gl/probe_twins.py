"""Twins of the functions of probes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from closed_forms import quad
from made_probes import grid_in, packed
from twins import SUM, Evaluate, twin, units, vec4

from srbf.basis.irradiance_harmonics import irradiance_at, radiance_harmonics
from srbf.export.asset_shader import probe_weights
from srbf.probe_grid import ProbeGrid

STEEP = 1e-4  # of the weights' sum: a surface a centimeter from a probe takes 30 / m times a distance's rounding, ten times over


def room() -> ProbeGrid:
    """A box with a thin wall across most of it."""
    low, high = np.zeros(3), np.array([3.0, 2.0, 2.2])
    return grid_in(low, high, quad([1.4, -1, -1], [1.4, 1.5, -1], [1.4, 1.5, 3], [1.4, -1, 3]))


def between(grid: ProbeGrid) -> np.ndarray:
    """(n, 3): places in the grid and around it, off the planes through its nodes, where two roundings may take other nodes."""
    rng = np.random.default_rng(52)
    steps = rng.integers(-1, grid.counts, (400, 3)) + rng.uniform(1e-3, 1 - 1e-3, (400, 3))
    return (np.array(grid.origin) + grid.spacing * steps).astype(np.float32)


def numbers(grid: ProbeGrid) -> str:
    """A grid as the shader's first arguments have it."""
    origin = ", ".join(repr(float(x)) for x in (*grid.origin, grid.spacing))
    return f"vec4({origin}), ivec3({', '.join(map(str, grid.counts))})"


def images(grid: ProbeGrid) -> dict[str, np.ndarray]:
    x, y, z = grid.counts
    rows = np.column_stack([grid.places, grid.sources]).astype(np.float32).reshape(y * z, x, 4)
    return {"places": rows, "nearness": grid.nearness.astype(np.float32)}


@twin("probes/probe_node.glsl")
def _(evaluate: Evaluate) -> None:
    grid = room()
    points = between(grid)
    for corner in range(8):
        expression = f"vec4(srbfProbeNode({numbers(grid)}, {corner}, a.xyz), 0.0)"
        found = evaluate("probes/probe_node.glsl", expression, vec4(points))[:, :3].astype(int) @ [
            1,
            grid.counts[0],
            np.prod(grid.counts[:2]),
        ]
        probe, _ = replace(grid, sources=np.arange(grid.count)).weights(points)
        assert (found == probe[:, corner]).all()


@twin("probes/probe_weight.glsl")
def _(evaluate: Evaluate) -> None:
    grid = room()
    points = between(grid)
    found = np.stack(
        [
            evaluate(
                "probes/probe_weight.glsl",
                f"vec4(srbfProbeWeight(places, nearness, {numbers(grid)}, {c}, a.xyz))",
                vec4(points),
                images=images(grid),
            )[:, 0]
            for c in range(8)
        ],
        axis=1,
    )
    _, expected = grid.weights(points)
    np.testing.assert_allclose(found / found.sum(axis=1, keepdims=True), expected, atol=STEEP)
    assert (expected < 1e-3).mean() > 0.1, "some probes do not see some places"


@twin("probes/probe_irradiance.glsl")
def _(evaluate: Evaluate) -> None:
    grid = room()
    points, normals = between(grid), units(len(between(grid)), 53)
    radiance = np.random.default_rng(54).normal(size=(grid.count, 9, 3)).astype(np.float32)[grid.sources]
    radiance[:, 0] += 3
    expression = f"vec4(srbfProbeIrradiance(light, places, nearness, {numbers(grid)}, a.xyz, b.xyz), 0.0)"
    light = packed(grid, radiance)
    found = evaluate("probes/probe_irradiance.glsl", expression, vec4(points), vec4(normals), images={"light": light, **images(grid)})[
        :, :3
    ]
    probe, weight = grid.weights(points)
    expected = irradiance_at(np.einsum("ne,nekc->nkc", weight, radiance[probe].astype(float)), normals)
    np.testing.assert_allclose(found, expected, atol=(STEEP + SUM) * expected.max())
    assert expected.min() >= 0 and np.ptp(expected) > 1


@twin("probes/probe_harmonics.glsl")
def _(evaluate: Evaluate) -> None:
    grid = room()
    picture = np.random.default_rng(55).uniform(0, 2, (grid.counts[1] * grid.counts[2], 12 * grid.counts[0], 3)).astype(np.float32)
    expected = packed(grid, radiance_harmonics(grid.values(picture))[grid.sources])
    row, column = np.divmod(np.arange(expected.shape[0] * expected.shape[1]), expected.shape[1])
    found = evaluate(
        "probes/probe_harmonics.glsl",
        f"srbfProbeHarmonics(facets, places, weights, {grid.counts[0]}, ivec2(a.xy))",
        vec4(np.column_stack([column, row, row])),
        declarations="uniform vec4 weights[84];",
        arrays={"weights": probe_weights()},
        images={"facets": picture, "places": images(grid)["places"]},
    )
    np.testing.assert_allclose(found, expected.reshape(-1, 4), atol=12 * SUM)
