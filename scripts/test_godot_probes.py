"""Compare what moves between probes in Godot with numpy: planes through a room with a partition; exits 1 if they differ.

As scripts/test_godot.py, in the same chroot, on both renderers. Numbers are relative root mean squares: of the irradiance on the
probes' facets against `srbf relight`, whose shadows are rays, and of the planes' pixels against `light_at` of the facets as Godot has
them.
    python scripts/test_godot_probes.py [--keep]
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

import godot_renderers as godot
import numpy as np
from godot_lights import Z_UP, transform
from godot_surfels import lights
from probe_assets import probes_of_room, write_probes
from test_godot_surfels import edge_of, read, relative

from srbf.asset import Asset
from srbf.export.godot import write
from srbf.methods import relight
from srbf.relighting.probe_light import harmonics, light_at

SIZE = (96, 64)  # pixels of a plane
MOST_FACETS = 0.1  # of random tables, which add up the differences of shadow maps and rays
MOST = 2e-3  # half floats
# Middle, right, up (z up), and the normal that the pixels have: across the partition at x = 0.5, and along it, 2 cm on either side.
PLANES = {
    "floor": ((0.0, 0.0, 1.1), (1, 0, 0), (0, 1, 0), (0.3, -0.5, 0.8)),
    "before": ((0.48, 0.0, 1.25), (0, 1, 0), (0, 0, 1), (-0.9, 0.1, 0.4)),
    "behind": ((0.52, 0.0, 1.25), (0, 1, 0), (0, 0, 1), (0.2, 0.9, -0.4)),
}
ACROSS, ALONG = 3.6, 2.4  # meters


def plane(name: str) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    """(points of the pixels, their normals, the job's numbers)."""
    middle, right, up, normal = (np.array(vector, np.float64) for vector in PLANES[name])
    normal = normal / np.linalg.norm(normal)
    width, height = SIZE
    x = ((np.arange(width) + 0.5) / width - 0.5) * ACROSS
    y = (0.5 - (np.arange(height) + 0.5) / height) * ALONG
    points = middle + x[None, :, None] * right + y[:, None, None] * up
    turn = Z_UP[:3, :3].T
    frame = np.eye(4)
    frame[:3] = np.stack([turn @ right, turn @ up, turn @ np.cross(right, up), turn @ middle], axis=1)
    facing = turn @ normal
    numbers = {"frame": transform(frame), "normal": "Vector3({}, {}, {})".format(*facing), "across": ACROSS, "along": ALONG}
    flat = points.reshape(-1, 3)
    return flat, np.broadcast_to(normal, flat.shape), {**numbers, "width": width, "height": height}


def compare(chroot: Path, keep: bool) -> int:
    """Print a line per renderer, set of lights and plane; returns the number of differences."""
    folder = Path(tempfile.mkdtemp(prefix="srbf-", dir=chroot / "tmp"))
    with tempfile.TemporaryDirectory() as scratch:
        write_probes(*probes_of_room(), Path(scratch) / "asset")
        asset = Asset.open(Path(scratch) / "asset")
    write(asset, folder)
    for script in ("godot_probes.gd", "godot_scene.gd"):
        shutil.copy(godot.ROOT / "tests" / "export" / script, folder)
    sets = lights(np.array([-1.2, 0.1, 1.2]), np.array([1.1, 0.7, 1.6]))
    jobs = [(name, across) for name in sets for across in PLANES]
    written = [{**plane(across)[2], "lights": [lit.node for lit in sets[name]], "output": f"{name}_{across}.raw"} for name, across in jobs]
    (folder / "jobs.json").write_text(json.dumps(written))
    godot.run(folder, chroot, "--headless", "--import")
    missed = 0
    for renderer, arguments in godot.RENDERERS.items():
        godot.run(folder, chroot, *arguments, "--script", "res://godot_probes.gd", display=True)
        for name, across in jobs:
            with edge_of(sets[name]):
                wanted = relight(asset, [lit.light() for lit in sets[name]])
            facets = read(folder / f"facets_{name}_{across}.raw").reshape(wanted.shape)
            points, normals, _ = plane(across)
            mixed = light_at(asset, harmonics(asset, facets.astype(np.float32)), points, normals) / np.pi
            found = read(folder / f"{name}_{across}.raw")
            if renderer == "gl_compatibility":  # which encodes 3D
                found = ((found + 0.055) / 1.055) ** 2.4
                mixed = np.maximum(mixed, (0.055 / 1.055) ** 2.4)
            errors = relative(facets, wanted), relative(found, mixed)
            missed += errors[0] > MOST_FACETS or errors[1] > MOST
            verdict = "" if errors[0] <= MOST_FACETS and errors[1] <= MOST else "  MISSED"
            godot.say(f"{renderer:18}{name:12}{across:8}{errors[0]:9.4f}{errors[1]:9.5f}{verdict}")
    if keep:
        godot.say(f"kept {folder}")
    else:
        shutil.rmtree(folder)
    return missed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keep", action="store_true", help="leave the project in the chroot's /tmp")
    arguments = parser.parse_args()
    godot.say(f"{'renderer':18}{'lights':12}{'plane':8}{'facets':>9}{'light':>9}")
    if missed := compare(godot.chroot_of_godot(), arguments.keep):
        sys.exit(f"{missed} planes differ from numpy's by more than {MOST}, or their probes by more than {MOST_FACETS}")
    godot.say("all within the bound")


if __name__ == "__main__":
    main()
