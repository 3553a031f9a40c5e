"""What receivers carry beside their mesh, and what stands over them: a bake has the light that Blender's own bake of the file has."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import SCENES, Baked, built

from srbf.bake.settings import BakeSettings, Receiver
from srbf.errors import BakeError
from srbf.io.image import read_image

pytestmark = pytest.mark.blender

SUNS = [(0.0, 0.0, 1.0), (0.5, 0.2, 0.84), (-0.6, 0.3, 0.74)]
MEAN = 0.01  # of unit irradiance, between means over all texels at these samples
NOISE = 0.09  # root mean square of single texels at shadow edges, which another seed draws otherwise
LOST = 0.03  # how much darker, at least, what stands there makes the receiver
SAMPLES = 32

CARRIED = [
    "hair",
    "hair_and_children",
    "hair_hidden_emitter",
    "particle_halves",
    "particle_collection",
    "emitted",
    "node_instances",
    "nested_instances",
    "node_instances_and_follower",
    "hair_and_node_instances",
    "hair_and_node_points",
    "node_points",
    "node_volume",
    "node_curves_and_instances",
    "viewport_node",
    "receiver_instances_on_faces",
]
OVERHEAD = ["fog_box", "volume_object", "curves_object", "point_cloud", "metaballs", "text_and_curve", "face_instances", "render_steps"]
KEPT = ["simplified", "linked_lights", "indirect_only", "holdout_occluder", "shadow_catcher_occluder", "lattice", "seen_indirectly"]


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    return built("bake_fidelity.py", tmp_path_factory)


def bake(scene: Path, folder: Path, receiver: str = "lightmap:Ground", **settings: object) -> Baked:
    listed = folder.with_suffix(".lp")
    lines = [f"{i}.png {x} {y} {z}" for i, (x, y, z) in enumerate(SUNS)]
    listed.write_text("\n".join([str(len(SUNS)), *lines]))
    small = {"width": 32, "height": 32, "samples": SAMPLES, "validation": 0, "holdout": 0, "holdout_samples": 4, "light_list": listed}
    return Baked(scene, folder, BakeSettings(Receiver.parse(receiver), **{**small, **settings}))


@pytest.fixture(scope="module")
def own(made, tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> dict[str, np.ndarray]:
    """(3, 32, 32, 3) Blender's own bake of each scene that a chosen test asks for, all by one process."""
    of_tests = (item.callspec.params["name"] for item in request.session.items if "own" in item.fixturenames and hasattr(item, "callspec"))
    out, suns = tmp_path_factory.mktemp("own") / "own.npz", " ".join(",".join(map(str, sun)) for sun in SUNS)
    scenes = [str(made(name)) for name in {"hair": 0, **dict.fromkeys(of_tests)}]
    line = [sys.executable, str(SCENES / "bake_fidelity.py"), "bake", str(out), "Ground", suns, *scenes]
    subprocess.run(line, check=True, capture_output=True, timeout=300)
    return dict(np.load(out))


def check_equal(got: np.ndarray, expected: np.ndarray) -> None:
    for image, other in zip(got, expected, strict=True):
        assert image.mean() == pytest.approx(other.mean(), abs=MEAN)
        assert np.sqrt(((image - other) ** 2).mean()) < NOISE


@pytest.mark.parametrize("name", [*CARRIED, *OVERHEAD, *KEPT])
def test_a_bake_has_the_light_of_blenders_own(made, own: dict[str, np.ndarray], tmp_path: Path, name: str) -> None:
    capture = bake(made(name), tmp_path / "capture").capture
    got = np.stack([capture.image(i) for i in range(len(SUNS))])
    check_equal(got, own[name])
    cosines = np.array([z / np.linalg.norm((x, y, z)) for x, y, z in SUNS])
    assert (cosines - got.mean(axis=(1, 2, 3))).max() > LOST  # so that an empty scene would not pass


def test_an_indirect_bake_keeps_hair_and_says_what_rays_will_miss(made, own: dict[str, np.ndarray], tmp_path: Path) -> None:
    baked = bake(made("hair"), tmp_path / "capture", transport="indirect")
    assert any("scene.glb" in line and "hair of 'Ground'" in line for line in baked.said)
    capture = baked.capture
    parts = [read_image(capture.folder / light["direct"]) for light in capture.manifest["lights"]]
    check_equal(np.stack([capture.image(i) + part for i, part in enumerate(parts)]), own["hair"])


def test_fog_is_no_wall_in_the_scene_file(made, tmp_path: Path) -> None:
    """A box of fog has triangles that stop no light: direct light by rays would be black beneath it."""
    baked = bake(made("fog_box"), tmp_path / "capture", transport="indirect", samples=2)
    assert any("volumes of 'Cube'" in line for line in baked.said)
    assert b'"Cube"' not in (baked.capture.folder / "scene.glb").read_bytes()


def test_a_receiver_of_nothing_but_instances_is_their_mesh(made, tmp_path: Path) -> None:
    """Nine blocks of 0.5 x 0.5 m, 0.6 m apart, under a ball: nine charts, whose middle one the ball shades."""
    capture = bake(made("only_instances"), tmp_path / "capture").capture
    covered = capture.coverage() > 0
    position = capture.geometry("position")[covered]
    assert covered.mean() > 0.3
    middles = {(round(float(x) / 0.6), round(float(y) / 0.6)) for x, y, _ in position}
    assert middles == {(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)}
    near = np.linalg.norm(position[:, :2], axis=1) < 0.15
    noon = capture.image(0)[covered].mean(axis=1)
    assert noon[near].max() < 0.2 and noon[np.linalg.norm(position[:, :2], axis=1) > 0.3].min() > 0.95


def test_what_simplify_would_cull_still_casts(made, tmp_path: Path) -> None:
    """A lid of the square's size, 1.5 m up and 0.5 m aside, which the camera does not see, leaves a quarter of it lit at noon."""
    capture = bake(made("culled"), tmp_path / "capture", samples=4).capture
    assert capture.image(0).mean() == pytest.approx(0.25, abs=0.02)


def test_a_render_only_screw_is_what_is_baked(made, tmp_path: Path) -> None:
    capture = bake(made("screwed_receiver"), tmp_path / "capture", samples=2).capture
    radius = np.linalg.norm(capture.geometry("position")[capture.coverage() > 0][:, :2], axis=1)
    assert radius.min() > 0.19  # of 3 steps, the viewport's, the disc's hole would reach in to 0.1


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("caught", "'Ground' is a shadow catcher.*Shadow Catcher off"),
        ("held_out", "'Ground' is a holdout.*Holdout off"),
        ("held_out_by_collection", "collection 'Held', which the view layer holds out"),
        ("held_out_by_material", "material 'ShaderNodeHoldout', a Holdout"),
        ("unseen_by_rays", "Ray Visibility on"),
    ],
)
@pytest.mark.parametrize("kind", ["lightmap", "vertices"])
def test_what_hides_a_receiver_is_named(made, tmp_path: Path, name: str, words: str, kind: str) -> None:
    with pytest.raises(BakeError, match=words) as caught:
        bake(made(name), tmp_path / "capture", f"{kind}:Ground", **({"width": 4, "height": 1} if kind == "vertices" else {}))
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "capture" / "capture.json").exists()


def test_equal_bakes_are_equal_to_the_bit(made, tmp_path: Path) -> None:
    """With hair, particles and instances too: every worker sets them apart again."""
    for name in ("hair", "node_curves_and_instances"):
        first, second = (bake(made(name), tmp_path / f"{name} {i}", samples=2).capture.folder for i in range(2))
        for path in [*sorted(first.rglob("*.exr")), first / "capture.json"]:
            assert path.read_bytes() == (second / path.relative_to(first)).read_bytes(), path.name
