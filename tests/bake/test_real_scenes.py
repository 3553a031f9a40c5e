"""Receivers of every kind by real Cycles: atlases, instances, libraries, densities, vertices, closed rooms, cameras; at world points."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import Baked
from typer.testing import CliRunner, Result

from srbf.bake.run import Bake, Reporter
from srbf.bake.scene_query import objects_of, with_size
from srbf.bake.settings import BakeSettings, Receiver, captures_of
from srbf.capture import COVERED, Capture
from srbf.cli import app
from srbf.errors import BakeError, InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.io.image import read_image
from srbf.lights import DirectionalLight, PointLight
from srbf.methods import relight
from srbf.methods.relighting_map import RelightingMap
from srbf.visibility.rays import RayTracer
from srbf.visibility.receivers import Receivers

pytestmark = pytest.mark.blender

HALF = 2.0**-10  # of a half float, and Cycles' own rounding of a cosine
FAR = 100.0  # meters between objects of a scene that must not shade each other
SMALL = {"width": 48, "height": 48, "lights": 6, "samples": 1, "validation": 0, "holdout": 1, "holdout_samples": 4}


@pytest.fixture
def bake(scene: Callable[[str], Path], tmp_path: Path) -> Callable[..., Baked]:
    """Bake receivers small and quick, in one capture; keyword arguments are BakeSettings."""

    def run(name: str, *receivers: str, folder: str = "capture", uv_layer: str | None = None, unwrap="smart", **settings) -> Baked:
        (receiver,) = captures_of([Receiver.parse(word, uv_layer, unwrap) for word in receivers])
        quantity = "radiance" if receiver.kind == "view" else "irradiance"
        planned = BakeSettings(receiver, **{**SMALL, "quantity": quantity, **settings})
        return Baked(scene(name), tmp_path / folder, with_size(Bake(scene(name), tmp_path / folder, planned)).settings)

    return run


def check_cosines(capture: Capture, where: np.ndarray, normal: tuple[float, float, float]) -> None:
    """Every image of the capture is max(0, N·L) at the texels `where`, and the normal map says N."""
    assert where.any()
    np.testing.assert_allclose(capture.geometry("normal")[where], np.broadcast_to(normal, (where.sum(), 3)), atol=1e-3)
    for index, light in enumerate(capture.lights):
        expected = max(0.0, float(np.dot(normal, light.direction)))
        np.testing.assert_allclose(capture.image(index)[where], expected, rtol=HALF, atol=2e-4)


TILTED = (0.0, -np.sin(0.5), np.cos(0.5))


def test_objects_of_one_mesh_get_texels_of_their_own(bake) -> None:
    baked = bake("shared", "lightmap:Flat", "lightmap:Tilted", "lightmap:Mirrored", width=64, height=64)
    capture = baked.capture
    names = [one["object"] for one in capture.manifest["receivers"]]
    assert names == ["Flat", "Tilted", "Mirrored"] and "receiver" not in capture.manifest
    assert any("3 objects" in line and "overlaps itself on about 67%" in line for line in baked.said)
    covered, x = capture.coverage() > 0, capture.geometry("position")[..., 0]
    counts = []
    for place, normal in enumerate([(0, 0, 1), TILTED, (np.sin(0.7), 0, np.cos(0.7))]):
        mine = covered & (np.abs(x - place * FAR) < FAR / 2)
        check_cosines(capture, mine, normal)
        along = (capture.geometry("position")[mine].astype(np.float64) - [place * FAR, 0, 0]) @ normal
        np.testing.assert_allclose(along, 0, atol=1e-3)
        counts.append(mine.sum())
    assert counts[1] / counts[0] == pytest.approx(2, rel=0.15) and counts[2] / counts[0] == pytest.approx(1, rel=0.15)  # one density
    layers = json.loads((capture.folder / "uv.json").read_text())["objects"]
    assert [layer["object"] for layer in layers] == names
    assert all(len(layer["per_loop"]) == 4 and layer["uv_layer"] == "srbf lightmap" for layer in layers)
    again = bake("shared", "lightmap:Flat", "lightmap:Tilted", "lightmap:Mirrored", width=64, height=64, folder="again")
    assert {p.name: p.read_bytes() for p in (again.capture.folder / "lights").iterdir()} == {
        p.name: p.read_bytes() for p in (capture.folder / "lights").iterdir()
    }


def test_layers_that_lie_side_by_side_are_used(bake) -> None:
    baked = bake("side by side", "lightmap:Left", "lightmap:Right")
    capture = baked.capture
    assert not any("packed" in line for line in baked.said) and not (capture.folder / "uv.json").exists()
    assert [one["uv_layer"] for one in capture.manifest["receivers"]] == ["UV", "UV"]
    covered, position = capture.coverage() > 0, capture.geometry("position")
    columns = np.broadcast_to((np.arange(48) + 0.5) / 48, (48, 48))
    assert (position[..., 0][covered & (columns < 0.5)] < 2).all() and (position[..., 0][covered & (columns > 0.5)] > FAR - 2).all()
    check_cosines(capture, covered, (0, 0, 1))
    albedo = capture.geometry("albedo")
    for x, color in ((-1.0, (1, 1, 1)), (FAR - 0.5, (0.5, 0.25, 0.125)), (FAR + 0.5, (0.1, 0.8, 0.1))):
        near = covered & (np.abs(position[..., 0] - x) < 0.4)
        np.testing.assert_allclose(albedo[near], np.broadcast_to(color, (near.sum(), 3)), rtol=0.01)


def test_a_collection_with_children_modifiers_and_instances(bake, scene, tmp_path: Path) -> None:
    kit = scene("kit")
    assert objects_of(kit, ["Kit"]) == ["Deep", "Doubled", "Plate"]  # not what is hidden
    assert objects_of(kit, ["Inner"]) == ["Deep"]
    with pytest.raises(BakeError, match="expected a collection 'Nothing'.*'Kit'"):
        objects_of(kit, ["Nothing"])
    capture = bake("kit", "lightmap:Plate", "lightmap:Doubled", "lightmap:Deep", "lightmap:Set", width=96, height=96).capture
    names = [one["object"] for one in capture.manifest["receivers"]]
    assert names == ["Plate", "Doubled", "Deep", "Set/Deep", "Set/Doubled", "Set/Plate"]
    check_kit(capture)


def check_kit(capture: Capture) -> None:
    """Four plates on the ground, and the four that the empty shows, tilted about x through its own place."""
    covered, position = capture.coverage() > 0, capture.geometry("position")
    for x, y in ((0, 0), (FAR, 0), (FAR, FAR), (2 * FAR, 0)):
        ground = covered & (np.hypot(position[..., 0] - x, position[..., 1] - y) < 2)
        check_cosines(capture, ground, (0, 0, 1))
        raised = (x, -3 * FAR + y * np.cos(0.5), 10 + y * np.sin(0.5))
        shown = covered & (np.linalg.norm(position - np.array(raised), axis=2) < 2)
        check_cosines(capture, shown, TILTED)


def test_what_a_library_holds_bakes_alike(bake) -> None:
    baked = bake("linked", "lightmap:Plate", "lightmap:Doubled", "lightmap:Deep", "lightmap:Set", width=96, height=96)
    check_kit(baked.capture)
    local = bake("kit", "lightmap:Plate", "lightmap:Doubled", "lightmap:Deep", "lightmap:Set", width=96, height=96, folder="local").capture
    np.testing.assert_array_equal(baked.capture.geometry("position"), local.geometry("position"))
    for index in range(len(local.lights)):
        np.testing.assert_array_equal(baked.capture.image(index), local.image(index))


@pytest.mark.parametrize("unwrap", ["smart", "lightmap-pack"])
def test_texels_per_meter(bake, scene, tmp_path: Path, unwrap: str) -> None:
    said: list[str] = []
    receiver = Receiver("lightmap", "Flat", also=("Tilted", "Mirrored"), unwrap=unwrap)
    planned = Bake(scene("shared"), tmp_path / "dense", BakeSettings(receiver, **SMALL))
    planned = with_size(planned, 12.0, said.append)
    size = planned.settings.width
    assert size == planned.settings.height and size % 4 == 0 and any("12 per meter" in line for line in said)
    planned.run(Reporter())
    capture = Capture.open(planned.folder)
    area = 4 + 8 + 4  # square meters of the three
    assert np.sqrt((capture.coverage() > 0).sum() / area) == pytest.approx(12 * size / (size - 2), rel=0.04)


def test_a_density_that_no_lightmap_can_have(scene, tmp_path: Path) -> None:
    planned = Bake(scene("shared"), tmp_path / "dense", BakeSettings(Receiver("lightmap", "Tilted"), **SMALL))
    with pytest.raises(
        InputError, match=r"at most 16384 .* found \d+ at 1e\+06 texels per meter on 8 square.*texels_per_meter=5792.61` or"
    ):
        with_size(planned, 1e6)
    with pytest.raises(InputError, match="above 0"):
        with_size(planned, -1.0)


def test_lightmap_pack_and_keep(bake) -> None:
    capture = bake("cube", "lightmap:Cube", uv_layer="srbf lightmap", unwrap="lightmap-pack", width=96, height=96).capture
    covered, normal = capture.coverage() > 0, capture.geometry("normal")
    assert covered.mean() > 0.3
    for axis in np.concatenate([np.eye(3), -np.eye(3)]):
        check_cosines(capture, covered & (normal @ axis > 0.9), tuple(axis))
    with pytest.raises(BakeError, match="Stacked.*overlaps itself on about 50%.*unwrap=smart"):
        bake("overlapping", "lightmap:Stacked", unwrap="keep", folder="refused")
    with pytest.raises(BakeError, match="3 objects.*about 67%.*unwrap=smart"):
        bake("shared", "lightmap:Flat", "lightmap:Tilted", "lightmap:Mirrored", unwrap="keep", folder="all refused")


@pytest.mark.parametrize(
    ("name", "words"), [("Stacked", "overlaps itself on about 50%"), ("Outside", r"leaves \[0, 1\] \(from 0 to 2.5\)")]
)
def test_layers_that_do_not_fit_are_reported_with_numbers(bake, name: str, words: str) -> None:
    baked = bake("overlapping", f"lightmap:{name}", lights=2)
    line = next(line for line in baked.said if "made a lightmap UV layer" in line)
    assert re.search(words, line)
    check_cosines(baked.capture, baked.capture.coverage() > 0, (0, 0, 1))
    kept = bake("overlapping", f"lightmap:{name}", uv_layer="UV", folder="kept", lights=2)
    assert any("used as requested" in line for line in kept.said)


def listed(capture: Capture, image: np.ndarray) -> np.ndarray:
    """The rows of an image that are vertices, in vertex order."""
    count = capture.manifest["receiver"]["count"]
    return image.reshape(capture.width * capture.height, -1)[:count]


def test_vertices_of_a_cube_take_the_mean_of_their_faces(bake) -> None:
    capture = bake("cube", "vertices:Cube").capture
    assert capture.manifest["receiver"] == {"kind": "vertices", "object": "Cube", "count": 9}
    assert (capture.width, capture.height) == (9, 1)
    coverage = listed(capture, capture.coverage())[:, 0]
    np.testing.assert_array_equal(coverage, [1] * 8 + [0])
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
    position = listed(capture, capture.geometry("position"))[:8]
    np.testing.assert_allclose(position, corners * [-1, 1, 2], atol=1e-6)  # mirrored and stretched
    outward = corners * [-1, 1, 1]
    normal = listed(capture, capture.geometry("normal"))[:8]
    assert ((normal * outward) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-5)
    np.testing.assert_allclose(listed(capture, capture.geometry("albedo"))[:8], 1, atol=1e-3)
    for index, light in enumerate(capture.lights):
        expected = np.maximum(outward * light.direction, 0).sum(axis=1) / 3  # three right angles: each face a third
        np.testing.assert_allclose(listed(capture, capture.image(index))[:8], np.repeat(expected[:, None], 3, axis=1), rtol=1e-3, atol=2e-4)


def test_vertices_of_a_flat_fan_respond_by_the_cosine_however_it_is_cut(bake) -> None:
    baked = bake("fan", "vertices:Fan")
    assert any("steel" in line and "Lambert" in line for line in baked.said)
    radiance = bake("fan", "vertices:Fan", quantity="radiance", folder="radiance").capture
    for index, light in enumerate(baked.capture.lights):
        np.testing.assert_allclose(listed(baked.capture, baked.capture.image(index)), light.direction[2], rtol=1e-3)
        paint = listed(radiance, radiance.image(index))[2:4]  # the vertices that no metal touches
        np.testing.assert_allclose(paint, 0.5 * light.direction[2] / np.pi, rtol=2e-3)


def test_vertices_are_fitted_relit_and_evaluated(bake) -> None:
    capture = bake("cube", "vertices:Cube", lights=60, holdout=6).capture
    asset = RelightingMap(k=25).encode(capture)
    report = evaluate(asset, capture)
    assert report["holdout"]["relative_rmse"] < 0.12  # 25 Gaussians of three clamped cosines
    point_light = (0.0, 0.0, 500.0)  # so far above that it is a sun: the four upper corners see a third of it each
    relit = listed(capture, relight(asset, [PointLight(point_light, a0=498.0, falloff="inverse-square")]))
    ringing = 0.07  # of 25 Gaussians at the kink where a face turns away
    np.testing.assert_allclose(relit[[1, 3, 5, 7]], 1 / 3, atol=ringing)
    np.testing.assert_allclose(relit[[0, 2, 4, 6]], 0, atol=ringing)


def test_vertices_that_cannot_be(bake) -> None:
    with pytest.raises(InputError, match="vertices with transport combined"):
        bake("cube", "vertices:Cube", transport="indirect")
    with pytest.raises(BakeError, match="expected an object 'Nobody'"):
        bake("cube", "vertices:Nobody")


@pytest.mark.parametrize("sun_angle", [0.0, 0.3])
def test_a_closed_room_lit_through_its_ceiling(bake, sun_angle: float) -> None:
    """As bright as with no ceiling, and brighter: the ceiling sends back what the floor sends up. Closed it is dark."""
    settings = {"sun_angle": sun_angle, "samples": 64, "lights": 2, "holdout": 0, "width": 24, "height": 16}
    with pytest.raises(BakeError, match="black"):
        bake("closed room", "lightmap:Room", folder="closed", **settings)
    lit = bake("closed room", "lightmap:Room", folder="lit", no_shadow=("Ceiling",), **settings).capture
    bare = bake("open room", "lightmap:Room", folder="bare", **settings).capture
    assert lit.manifest["source"]["settings"]["no_shadow"] == ["Ceiling"]
    covered, position = lit.coverage() > 0, lit.geometry("position")
    floor = covered & (lit.geometry("normal")[..., 2] > 0.9)
    for index, light in enumerate(lit.lights):
        with_ceiling, without = lit.image(index)[..., 0], bare.image(index)[..., 0]
        assert with_ceiling[covered].mean() > 1.05 * without[covered].mean()
        lx, ly, lz = light.direction
        t = (2 - position[..., 2]) / lz
        enters = (np.abs(position[..., 0] + t * lx) < 0.8) & (np.abs(position[..., 1] + t * ly) < 0.8)
        if sun_angle == 0 and (floor & enters).any():
            assert (with_ceiling[floor & enters] > lz).all()  # direct light whole, and bounces on top


def test_a_lattice_casts_its_pattern(bake) -> None:
    capture = bake("lattice", "lightmap:Floor", lights=12).capture
    position, checked = capture.geometry("position"), set()
    for index, light in enumerate(capture.lights):
        lx, ly, lz = light.direction
        if lz < 0.3:
            continue
        x = position[..., 0] + 0.5 * lx / lz  # where the ray passes the slats' height
        y = position[..., 1] + 0.5 * ly / lz
        phase = (x + 0.8 + 0.2) % 0.4 - 0.2  # from the nearest slat's middle
        within = np.abs(x) < 0.8
        clear = (np.abs(np.abs(phase) - 0.1) > 2 / 48) & (np.abs(y) < 8.5) & within
        blocked = np.abs(phase) < 0.1
        expected = np.where(blocked, 0, lz)
        np.testing.assert_allclose(capture.image(index)[..., 0][clear], expected[clear], atol=2e-3)
        checked |= set(blocked[clear].tolist())
    assert checked == {True, False}


def test_a_normal_map_decides_the_cosine(bake) -> None:
    """And Cycles' shadowing of a bumped surface [Conty2019]: 2 / (1 + sqrt(1 + tan²(N, Ng) / 8 tan²(L, Ng)))."""
    capture = bake("normal mapped", "lightmap:Plane").capture
    leaning = np.array([np.sin(0.5), 0, np.cos(0.5)])
    np.testing.assert_allclose(capture.geometry("normal"), np.broadcast_to(leaning, (48, 48, 3)), atol=1e-3)
    for index, light in enumerate(capture.lights):
        cosine = max(0.0, float(leaning @ light.direction))
        slope = 1 / light.direction[2] ** 2 - 1
        shadowing = 2 / (1 + np.sqrt(1 + np.tan(0.5) ** 2 / 8 * slope))
        np.testing.assert_allclose(capture.image(index), cosine * shadowing, rtol=2e-3, atol=1e-3)


def test_metal_shines_in_radiance_towards_lights_near_the_zenith(bake) -> None:
    capture = bake("glossy", "lightmap:Plane", quantity="radiance", lights=40, samples=16).capture
    up = capture.directions()[:, 2]
    brightness = np.array([capture.image(i).mean() for i in range(len(capture.lights))])
    order = np.argsort(up)
    assert brightness[up > 0.9].min() > 4 * brightness[up < 0.5].max()
    assert np.corrcoef(np.argsort(np.argsort(brightness)), np.argsort(order))[0, 1] > 0.95  # it falls with the angle


def test_a_moved_asset_responds_as_the_bake_of_the_moved_object(bake) -> None:
    method = RelightingMap(k=40, spread=0.6, ridge=0.01)
    still = method.encode(bake("moved", "lightmap:Plane", folder="still", lights=120, domain="sphere").capture)
    moved = method.encode(bake("moved", "lightmap:Moved Plane", folder="moved", lights=120, domain="sphere").capture)
    c, s = np.cos(0.8), np.sin(0.8)
    world = np.array([[c, -s, 0, FAR], [s, c, 0, 5], [0, 0, 1, 2], [0, 0, 0, 1]])
    carried = replace(still, manifest={**still.manifest, "asset_from_world": np.linalg.inv(world).tolist()})
    np.testing.assert_allclose(still.images["position"] @ world[:3, :3].T + world[:3, 3], moved.images["position"], atol=1e-3)
    for lights in (
        [DirectionalLight((1, 0.3, 0.5))],
        [PointLight((FAR + 1.5, 5.5, 4.0), falloff="inverse-square")],
    ):
        here, there = relight(carried, lights), relight(moved, lights)
        unmoved = relight(still, lights)
        rms = np.sqrt((there**2).mean())
        # Two fits to lights that stand elsewhere on the sphere as the object sees them; without the move they are far apart.
        assert np.sqrt(((here - there) ** 2).mean()) < 0.06 * rms
        assert np.sqrt(((unmoved - there) ** 2).mean()) > 2 * np.sqrt(((here - there) ** 2).mean())


@pytest.mark.parametrize("name", ["Straight", "Shifted", "Flat"])
def test_cameras_reproject_within_a_hundredth_of_a_pixel(bake, name: str) -> None:
    """Through the recorded frame alone: the corners of the picture at one meter, in the camera's own axes."""
    width, height = 60, 40
    capture = bake("views", f"view:{name}", width=width, height=height, lights=2, holdout=0).capture
    camera = capture.manifest["source"]["camera"]
    right_top, right_bottom, left_bottom, _ = np.array(camera["frame"])
    covered = capture.coverage() == 1
    assert covered.sum() > 300
    local = (capture.geometry("position")[covered].astype(np.float64) - np.array(camera["matrix_world"])[:3, 3]) @ np.array(
        camera["matrix_world"]
    )[:3, :3]
    if name != "Flat":
        local = local * (left_bottom[2] / local[:, 2])[:, None]
    column = (local[:, 0] - left_bottom[0]) / (right_bottom[0] - left_bottom[0]) * width
    row = (right_top[1] - local[:, 1]) / (right_top[1] - right_bottom[1]) * height
    rows, columns = np.nonzero(covered)
    np.testing.assert_allclose(column, columns + 0.5, atol=0.01)
    np.testing.assert_allclose(row, rows + 0.5, atol=0.01)


def test_denoising_brings_few_samples_nearer_to_many(bake) -> None:
    small = {"width": 96, "height": 64, "lights": 2, "holdout": 0, "transport": "combined"}
    clean = bake("views", "view:Straight", folder="clean", samples=256, **small).capture
    noisy = bake("views", "view:Straight", folder="noisy", samples=2, sun_angle=0.0, **small).capture
    denoised = bake("views", "view:Straight", folder="denoised", samples=2, denoise=True, **small).capture
    covered = clean.coverage() == 1

    def error(capture: Capture) -> float:
        return float(np.sqrt(np.mean([((capture.image(i) - clean.image(i))[covered] ** 2).mean() for i in range(2)])))

    assert error(denoised) < error(noisy)
    with pytest.raises(InputError, match="a view of combined transport.*`denoise`"):
        bake("views", "lightmap:Plane", folder="none", denoise=True)


QUICK = ["--lights", "30", "--samples", "1", "--validation", "0", "--holdout", "2", "--holdout-samples", "4"]


def srbf(*arguments: object) -> Result:
    """The command line in this process; bakes still run in a worker's."""
    return CliRunner().invoke(app, list(map(str, arguments)))


def test_the_command_bakes_a_collection_at_a_density(scene, tmp_path: Path) -> None:
    done = srbf("bake", scene("kit"), "-o", tmp_path / "kit", "--collection", "Kit", "--texels-per-meter", 8, *QUICK)
    assert done.exit_code == 0, done.output
    capture = Capture.open(tmp_path / "kit")
    assert [one["object"] for one in capture.manifest["receivers"]] == ["Deep", "Doubled", "Plate"]
    assert (capture.width, capture.width % 4) == (capture.height, 0)


def test_the_command_bakes_cameras_into_folders_of_their_own(scene, tmp_path: Path) -> None:
    cameras = ["--receiver", "view:Straight", "--receiver", "view:Flat", "--size", "24x16"]
    done = srbf("bake", scene("views"), "-o", tmp_path / "two", *cameras, *QUICK)
    assert done.exit_code == 0, done.output
    for name in ("Straight", "Flat"):
        assert Capture.open(tmp_path / "two" / name).manifest["receiver"] == {"kind": "view", "camera": name}
    missing = srbf("bake", scene("views"), "-o", tmp_path / "none", *QUICK)
    assert missing.exit_code == 2 and "--receiver" in missing.output


def test_the_commands_take_vertices_as_any_other_receiver(scene, tmp_path: Path) -> None:
    capture, asset = tmp_path / "capture", tmp_path / "asset"
    dry = srbf("bake", scene("cube"), "-o", capture, "--receiver", "vertices:Cube", "--dry-run", *QUICK)
    assert dry.exit_code == 0 and "vertices: object Cube, count 9, 9x1" in dry.output and not capture.exists()
    assert srbf("bake", scene("cube"), "-o", capture, "--receiver", "vertices:Cube", *QUICK).exit_code == 0
    assert srbf("fit", capture, "-o", asset, "-k", 9).exit_code == 0
    told = srbf("evaluate", asset, capture, "--json")
    assert told.exit_code == 0 and json.loads(told.stdout)["holdout"]["relative_rmse"] < 0.5
    assert srbf("relight", asset, "--directional", "0,0,1", "-o", tmp_path / "lit.exr").exit_code == 0
    relit = read_image(tmp_path / "lit.exr", 3)[0]
    assert relit[[1, 3, 5, 7]].min() > relit[[0, 2, 4, 6]].max() + 0.1  # the upper four see the sun
    assert json.loads(srbf("info", asset, "--json").stdout)["width"] == 9


@pytest.mark.parametrize(
    ("name", "receivers", "no_shadow"),
    [("shared", ("lightmap:Flat", "lightmap:Mirrored"), ()), ("closed room", ("lightmap:Room",), ("Ceiling",))],
)
def test_rays_give_the_direct_light_of_an_atlas_and_of_a_closed_room_back(bake, name: str, receivers: tuple, no_shadow: tuple) -> None:
    capture = bake(name, *receivers, transport="indirect", no_shadow=no_shadow, lights=2, holdout_samples=32).capture
    tracer = RayTracer(Receivers.of(capture))
    covered = capture.coverage() >= COVERED
    for index in capture.indices("holdout"):
        true = capture.combined().image(index) - capture.image(index)
        found = tracer.directional(capture.directions([index]))[0]
        assert true[covered].mean() > 0.05
        assert np.median(np.abs(found - true)[covered].max(axis=1)) < 2e-3 * true.max()
