"""The extension inside Blender, in a process of its own for each test, and assets with known maps to show."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbf.asset import Asset
from srbf.basis.gaussian import r_table
from srbf.encode.quantization import quantize
from srbf.sphere import point_set
from srbf.stored_layers import layer_entries

SCRIPT = Path(__file__).parent / "in_blender.py"


@pytest.fixture
def in_blender() -> Callable[..., Any]:
    """Run a function of in_blender.py with a JSON argument; its JSON result."""

    def call(name: str, **case: Any) -> Any:
        done = subprocess.run([sys.executable, str(SCRIPT), name, json.dumps(case)], capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr
        return {**json.loads(done.stdout.strip().splitlines()[-1]), "stderr": done.stderr, "stdout": done.stdout}

    return call


@pytest.fixture
def make_asset(tmp_path: Path) -> Callable[..., Asset]:
    """Write an asset of smooth random maps on the plane [-1, 1]^2 at z = 0."""

    def make(
        name: str = "asset", k: int = 7, encoding: str = "half", size: tuple[int, int] = (12, 20), ambient: bool = True, **changes: Any
    ):
        height, width = size
        rng = np.random.default_rng(3)
        x = -1 + 2 * (np.arange(width) + 0.5) / width
        y = 1 - 2 * (np.arange(height) + 0.5) / height
        wave = rng.normal(size=(4, k, 3, 1, 1))
        maps = (wave[0] + wave[1] * np.sin(2 * x + wave[2]) * np.cos(2 * y[:, None] + wave[3])).transpose(0, 2, 3, 1).astype(np.float32)
        stored, scale, bias = quantize(maps, encoding)
        centers = point_set("fibonacci", k, "hemisphere")
        positions = np.zeros((height, width, 3), np.float32)
        positions[..., 0], positions[..., 1] = x[None, :], y[:, None]
        images = {"position": positions}
        if ambient:
            images["ambient"] = np.abs(maps[0]) * np.float32(0.1)
        table = r_table(0.5)
        manifest = {
            "format": "srbf-asset",
            "version": 1,
            "method": "relighting-map",
            "quantity": "irradiance",
            "transport": "combined",
            "width": width,
            "height": height,
            "domain": "hemisphere",
            **{image: f"{image}.exr" for image in images},
            "row_origin": "top",
            "axes": "z-up-right-handed",
            "asset_from_world": np.eye(4).tolist(),
            "maps": layer_entries("map", encoding, scale, bias),
            "basis": {"kind": "gaussian", "centers": centers.tolist(), "spread": 0.5},
            "r_table": {"file": "r_table.exr", "size": len(table)},
            "source": {"receiver": {"kind": "lightmap", "object": "Plane", "uv_layer": "lightmap"}},
            **changes,
        }
        asset = Asset(manifest, stored, scale, bias, {"r_table": table}, images)
        asset.save(tmp_path / name)
        return asset

    return make
