"""Transfer on rooms solved by radiosity: errors at lights that no one rendered, linearity, leaks, other kinds of lights, bad files."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_rooms import Room, room_of_surfels

from srbf import methods
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import ImageError, InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.fitting.options import fit
from srbf.lights import AreaLight, DirectionalLight, Light, NamedLight, PointLight, SpotLight
from srbf.methods import linear_response, outside_domain
from srbf.methods.surface_changes import Surfaces, emitted_by_objects, with_albedo
from srbf.methods.transfer import Transfer
from srbf.relighting.direct_light import Added
from srbf.solve.radiosity import Bounces, reciprocal
from srbf.visibility import transfer_basis as transfer_basis_module
from srbf.visibility.cloud_lights import CloudLights
from srbf.visibility.received import ReceivedLight
from srbf.visibility.transfer_basis import exchange_of, grouped, training_light, transfer_basis
from srbf.visibility.transfer_operator import OPERATOR_FILE, TransferOperator, is_traced

pytest.importorskip("embreex")
pytest.importorskip("sklearn")
pytestmark = pytest.mark.slow

BOX = Room.box((3, 2, 2), 0.25, 0.6)
APART = Room.box((4, 3, 2.5), 0.25, 0.6, (2.0, 3.0, 3.0))  # a wall without a door
SETTINGS = Transfer(clusters=8, components=12, rank=96, surfels=400)


@pytest.fixture(scope="module", autouse=True)
def few_lights() -> Iterator[None]:
    """A room of two colors needs fewer to make its shapes for."""
    with pytest.MonkeyPatch.context() as patch:
        for name, count in (("PLACED", 300), ("MOST_PLACED", 300), ("NEAR", 120), ("SPOTS", 120)):
            patch.setattr(transfer_basis_module, name, count)
        yield


@pytest.fixture(scope="module")
def capture(tmp_path_factory) -> Capture:
    return room_of_surfels(tmp_path_factory.mktemp("surfels") / "capture", BOX, 800)


@pytest.fixture(scope="module")
def asset(capture: Capture) -> Asset:
    return SETTINGS.encode(capture)


@pytest.fixture(scope="module")
def black(capture: Capture, tmp_path_factory) -> Capture:
    """The same with a black wall at x = 0."""
    own = copied(capture, tmp_path_factory)
    operator = TransferOperator.read(own.folder)
    albedo = np.where((operator.objects == 1)[:, None], 0, operator.cells.albedo).astype(np.float32)
    replace(operator, cells=replace(operator.cells, albedo=albedo)).write(own.folder, "made")
    return own


def light(place, **changes) -> PointLight:
    return PointLight(tuple(place), falloff="inverse-square", **changes)


def test_lights_that_no_one_rendered_are_relit(asset: Asset, capture: Capture) -> None:
    """The truth is of square cells of 25 cm, and of their centers: 9 % of the error is its own."""
    errors = evaluate(asset, capture)
    assert set(errors) == {"validation", "holdout", "lights"}
    assert errors["holdout"]["relative_rmse"] < 0.15
    assert asset.bytes_per_texel()["directional"] == 13


def test_energy_is_that_of_the_room(asset: Asset) -> None:
    transport = BOX.transport()
    for place in BOX.free[-6:]:
        found = linear_response(asset, [light(place)]).reshape(-1, 3)[: len(BOX.places)]
        truth = np.einsum("ijc,j->ic", transport, BOX.direct(place))
        np.testing.assert_allclose((BOX.areas @ found) / (BOX.areas @ truth), 1, atol=0.05)


def test_the_asset_on_disk_is_the_asset(asset: Asset, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    lights = [light((1.0, 1.0, 1.0)), SpotLight((2.0, 1.0, 1.5), falloff="inverse-square", direction=(0, 0, -1), inner=0.3, outer=0.5)]
    np.testing.assert_array_equal(linear_response(Asset.open(tmp_path / "asset"), lights), linear_response(asset, lights))


def test_lights_of_all_kinds_add_up_and_scale(asset: Asset) -> None:
    one, other = light((0.5, 0.6, 0.7), color=(2.0, 1.0, 0.5)), AreaLight((2.0, 1.0, 1.9), u=(0.4, 0, 0), v=(0, -0.4, 0))
    both = linear_response(asset, [one, other])
    np.testing.assert_allclose(both, linear_response(asset, [one]) + linear_response(asset, [other]), atol=1e-4 * both.max())
    np.testing.assert_allclose(linear_response(asset, [replace(one, a0=2.0)]), 4 * linear_response(asset, [one]), rtol=1e-3, atol=1e-4)
    assert not linear_response(asset, []).any()
    assert not linear_response(asset, [DirectionalLight((0.2, 0.3, 1.0))]).any(), "a sun through no window"


def test_two_rooms_without_a_door_exchange_no_light(tmp_path: Path) -> None:
    apart = Transfer(clusters=16, rank=96, surfels=400).encode(room_of_surfels(tmp_path / "capture", APART, 700))
    far = (APART.places[:, 0] > 2) | ((np.abs(APART.places[:, 0] - 2) < 1e-6) & (APART.normals[:, 0] > 0))
    lit = linear_response(apart, [light((1.0, 1.5, 1.2))]).reshape(-1, 3)[: len(APART.places)]
    assert np.abs(lit[far]).mean() < 0.005 * lit[~far].mean()


def test_full_rank_is_the_operator(capture: Capture) -> None:
    """As many shapes as the lights span: transfer times shapes is F_p (1 - rho F)^-1 rho, of lights that made them."""
    operator, inside = TransferOperator.read(capture.folder), CloudLights.of(capture)
    received = ReceivedLight(operator.cells, inside.occluders)
    lights = training_light(operator, received, inside.free)[:, :40]
    basis = transfer_basis(operator, lights, exchange_of(operator), 120)
    exchange = reciprocal(operator.exchange.toarray(), operator.cells.areas)
    for c in range(3):
        exact = operator.receivers @ Bounces(exchange, operator.cells.albedo[:, c].astype(np.float64)).radiosity(lights)
        found = basis.shapes @ (basis.transfer[:, :, c] @ lights)
        np.testing.assert_allclose(found, exact, atol=2e-3 * exact.max())


def test_shapes_on_surfels_are_those_on_receivers(capture: Capture) -> None:
    """With feedback and gather, as changed albedo needs them: one bounce more each round."""
    operator, inside = TransferOperator.read(capture.folder), CloudLights.of(capture)
    lights = training_light(operator, ReceivedLight(operator.cells, inside.occluders), inside.free)
    basis = transfer_basis(operator, lights, exchange_of(operator), 160)
    for c in range(3):
        direct = operator.cells.albedo[:, c : c + 1] * lights[:, :8]
        weights = np.linalg.solve(np.eye(len(basis.gather)) - basis.feedback[:, :, c], basis.gather @ direct)
        exact = basis.transfer[:, :, c] @ lights[:, :8]
        pictures = [basis.shapes @ found for found in (weights, exact)]
        assert np.linalg.norm(pictures[0] - pictures[1]) < 0.05 * np.linalg.norm(pictures[1])


@pytest.fixture(scope="module")
def editable(capture: Capture, tmp_path_factory) -> Asset:
    """Half of the red wall emits."""
    own = copied(capture, tmp_path_factory)
    operator = TransferOperator.read(own.folder)
    replace(operator, emission=np.outer(lower_half(operator), [4.0, 1.0, 2.0]).astype(np.float32)).write(own.folder, "made")
    return Transfer(clusters=8, components=24, rank=160, editable=True, encoding="half").encode(own)


def lower_half(operator: TransferOperator) -> np.ndarray:
    return (operator.objects == 1) & (operator.cells.places[:, 2] < 1)


def copied(capture: Capture, tmp_path_factory) -> Capture:
    folder = tmp_path_factory.mktemp("copy") / "capture"
    shutil.copytree(capture.folder, folder)
    return Capture.open(folder)


def test_a_repainted_wall_is_that_of_another_bake(editable: Asset, capture: Capture, tmp_path: Path) -> None:
    """Against the operator itself with the other albedo."""
    operator, inside = TransferOperator.read(capture.folder), CloudLights.of(capture)
    blue, one = (0.1, 0.2, 0.8), light((1.2, 0.9, 1.1))
    direct = ReceivedLight(operator.cells, inside.occluders).irradiance(one)[:, :1].astype(np.float32)
    exchange = reciprocal(operator.exchange.toarray(), operator.cells.areas)

    def exact(albedo: np.ndarray) -> np.ndarray:
        columns = [operator.receivers @ Bounces(exchange, albedo[:, c].astype(np.float64)).radiosity(direct)[:, 0] for c in range(3)]
        return np.stack(columns, axis=1).reshape(capture.height, capture.width, 3)

    painted = np.where((operator.objects == 1)[:, None], np.array(blue), operator.cells.albedo)
    changed = with_albedo(editable, {"Red wall": blue})
    change = linear_response(changed, [one]) - linear_response(editable, [one])
    expected = exact(painted) - exact(operator.cells.albedo)
    assert np.linalg.norm(change - expected) < 0.15 * np.linalg.norm(expected)
    assert expected[..., 2].mean() > 0 > expected[..., 0].mean()
    changed.save(tmp_path / "changed")
    np.testing.assert_array_equal(linear_response(Asset.open(tmp_path / "changed"), [one]), linear_response(changed, [one]))
    same = with_albedo(editable, {"Red wall": tuple(operator.cells.albedo[operator.objects == 1][0].tolist())})
    np.testing.assert_allclose(linear_response(same, [one]), linear_response(editable, [one]), rtol=1e-2, atol=1e-3)


def test_an_object_that_emits_lights_the_room(editable: Asset, capture: Capture) -> None:
    """In the pattern of the scene: its lower half alone."""
    operator = TransferOperator.read(capture.folder)
    exchange = reciprocal(operator.exchange.toarray(), operator.cells.areas).astype(np.float64)
    radiance, covered = np.array([1.0, 0.5, 0.0]), capture.coverage() > 0.5
    found = linear_response(editable, [NamedLight("Red wall", tuple(radiance))])
    for c in range(3):
        emitted = np.pi * radiance[c] * lower_half(operator)
        radiosity = np.linalg.solve(np.eye(len(exchange)) - operator.cells.albedo[:, c, None] * exchange, emitted)
        expected = (operator.receivers @ radiosity).reshape(capture.height, capture.width)[covered]
        assert np.linalg.norm(found[covered, c] - expected) <= 0.06 * np.linalg.norm(expected) + 1e-5
    both = linear_response(editable, [NamedLight("Red wall", (1.0, 1.0, 1.0)), light((1.2, 0.9, 1.1))])
    apart = linear_response(editable, [NamedLight("Red wall")]) + linear_response(editable, [light((1.2, 0.9, 1.1))])
    np.testing.assert_allclose(both, apart, rtol=1e-4, atol=1e-4)


def test_lights_are_not_measured_by_black_surfels(black: Capture) -> None:
    plain = replace(SETTINGS, surfels=200).encode(black)
    assert (plain.tables["cells"][0, :, 0] > 1e-3).all(), "the black wall is at x = 0"


def test_an_object_emits_in_the_pattern_of_the_scene(capture: Capture) -> None:
    """With a mean of 1 in each color, over what emits of it; without emission, evenly."""
    operator = TransferOperator.read(capture.folder)
    red, areas = operator.objects == 1, operator.cells.areas
    pattern = np.where((red & (operator.cells.places[:, 2] < 1))[:, None], np.array([4.0, 1.0, 0.0]), 0).astype(np.float32)
    pattern[:, 0] *= operator.cells.places[:, 1]
    found = emitted_by_objects(replace(operator, emission=pattern)).radiosity
    walls, half = found[:, 0], pattern.any(axis=1)
    np.testing.assert_allclose(walls, np.pi * np.broadcast_to(~red[:, None], walls.shape), rtol=1e-6)
    means = areas @ found[:, 1] / areas[half].sum()
    np.testing.assert_allclose(means, np.pi, rtol=1e-5)
    assert not found[~half, 1].any()
    np.testing.assert_allclose(found[half, 1, 0] / found[half, 1, 0].sum(), pattern[half, 0] / pattern[half, 0].sum(), rtol=1e-4)
    np.testing.assert_allclose(found[half, 1, 1:], np.pi, rtol=1e-5)


def test_what_cannot_change_is_said(editable: Asset, asset: Asset) -> None:
    for wrong in (lambda: with_albedo(asset, {"Walls": (0.5, 0.5, 0.5)}), lambda: linear_response(asset, [NamedLight("Walls")])):
        with pytest.raises(InputError, match="fit with `editable`"):
            wrong()
    with pytest.raises(InputError, match="expected an object of the asset .Walls, Red wall., found 'Sofa'"):
        with_albedo(editable, {"Sofa": (0.5, 0.5, 0.5)})
    for color in ((2.0, 0.5, 0.5), (0.5, -0.1, 0.5), (0.5, 0.5, float("nan"))):
        with pytest.raises(InputError, match="expected an `albedo` of 0 to 1 for 'Walls', found"):
            with_albedo(editable, {"Walls": color})


def test_an_object_that_emits_has_no_direct_light_to_add(editable: Asset) -> None:
    with Added(editable, "ray") as added:
        assert added.notes([NamedLight("Walls")]) == []


def test_lights_beyond_the_box_of_lights_are_traced(asset: Asset, monkeypatch: pytest.MonkeyPatch) -> None:
    beyond: list[Light] = [light((9.0, 1.0, 1.0))]
    assert outside_domain(asset, beyond) == []
    monkeypatch.setattr(methods, "has_embree", lambda: False)
    assert "its response is extrapolated" in outside_domain(asset, beyond)[0], "by the table of places"


def test_groups_are_of_one_object_and_objects_without_surfels_are_not_offered(editable: Asset, black: Capture) -> None:
    assert np.isin(Surfaces.of(editable).shares, (0, 1)).all()
    told = black.manifest["surfels"]
    more = replace(black, manifest={**black.manifest, "surfels": {**told, "objects": [*told["objects"], "Out of reach"]}})
    fitted = Transfer(clusters=2, components=2, rank=4, editable=True).encode(more)
    assert Surfaces.of(fitted).names == ("Walls", "Red wall")
    assert linear_response(fitted, [NamedLight("Red wall")]).mean() > 0.1, "black, it emits"


def test_a_scene_without_bounces_has_nothing_to_fit(capture: Capture) -> None:
    still = replace(capture, manifest={**capture.manifest, "surfels": {**capture.manifest["surfels"], "bounces": 0}})
    with pytest.raises(InputError, match="expected light that bounces onto the receivers"):
        SETTINGS.encode(still)


def test_groups_sum_their_surfels() -> None:
    values = np.arange(8, dtype=np.float32).reshape(2, 4)
    np.testing.assert_array_equal(grouped(values, np.array([0, 2, 0, 2]), 3), [[2, 0, 4], [10, 0, 12]])


def test_a_number_of_surfels_and_bytes_are_kept(capture: Capture) -> None:
    few = fit(capture, surfels=50, rank=32, clusters=4, method="transfer")
    assert few.manifest["surfel_transfer"]["surfels"] <= 50 and few.manifest["surfel_transfer"]["rank"] == 32
    chosen = fit(capture, budget=13)
    assert chosen.method == "transfer" and chosen.bytes_per_texel()["directional"] <= 13
    with pytest.raises(InputError, match="expected a `budget` for a capture of surfels"):
        fit(capture, psnr=40)


def test_damaged_form_factors_are_refused(capture: Capture, tmp_path: Path) -> None:
    assert is_traced(capture.folder, "made") and not is_traced(capture.folder, "other") and not is_traced(tmp_path, "made")
    for name in ("surfels.exr", OPERATOR_FILE):
        (tmp_path / name).write_bytes((capture.folder / name).read_bytes())
    (tmp_path / OPERATOR_FILE).write_bytes((capture.folder / OPERATOR_FILE).read_bytes()[:1000])
    with pytest.raises(ImageError, match="expected form factors of surfels"):
        TransferOperator.read(tmp_path)
    assert not is_traced(tmp_path, "made")


@pytest.mark.parametrize(
    ("settings", "words"), [({"surfels": 0}, "`surfels` auto or 1 to"), ({"rank": 0}, "`rank` auto or 1"), ({"clusters": 300}, "1 to 256")]
)
def test_settings_out_of_range_are_refused(settings: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Transfer(**settings)
