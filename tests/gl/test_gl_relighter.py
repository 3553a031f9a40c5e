"""The GPU relighter against numpy: every kind of light, encoding and pass layout, within the contract."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from srbf import methods
from srbf.asset import Asset
from srbf.errors import InputError, ShaderError
from srbf.gl.context import Limits
from srbf.light_geometry import attenuation, light_vectors
from srbf.lights import DirectionalLight, EnvironmentLight, Light, PointLight, SpotLight, moved
from srbf.methods import projected_weights
from srbf.methods.relighting_map import receiver_weights
from srbf.relighting.relighter import Relighter, relight

FLOAT = 1e-5  # the contract, of sum |c_i R_i| a texel (times color and attenuation)
HALF = 2 * 2.0**-10  # the contract: two steps of a half float
HALF_TINY = 2.0**-24  # spacing of subnormal halves: what no relative bound covers
# stored * scale + bias rounds three times, here and in numpy, whatever cancels: a bound by |c_i| alone would be one below rounding
DECODING = 2 * 3 * 2.0**-24
FINAL = 2.0**-23  # one rounding each of the sum with ambient

KS = (1, 7, 25, 60)
ENCODINGS = ("half", "float", "uint8")
SPOT = SpotLight((0.4, -0.3, 1.1), (0.5, 1.0, 2.0), a0=0.8, direction=(0.1, 0.2, -1.0), inner=0.3, outer=0.6)


def _environment() -> EnvironmentLight:
    image = np.random.default_rng(5).random((6, 12, 3)).astype(np.float32)
    return EnvironmentLight(image, (0.3, 0.2, 0.1))


LIGHTS: dict[str, list[Light]] = {
    "directional": [DirectionalLight((0.3, 0.5, 0.8), (1.0, 0.8, 0.3))],
    "environment": [_environment()],
    "point-linear": [PointLight((0.4, -0.2, 1.1), (1.0, 0.5, 2.0), a0=0.7)],
    "point-inverse-square": [PointLight((0.4, -0.2, 0.3), (1.0, 0.5, 2.0), a0=0.7, falloff="inverse-square", radius=0.5)],
    "spot": [SPOT],
    "narrow-spot": [replace(SPOT, falloff="inverse-square", inner=0.15, outer=0.2)],
    "several": [
        DirectionalLight((0.3, -0.5, 0.4), (0.2, 0.8, 0.3)),
        PointLight((-0.4, 0.6, 0.9), (1.0, 0.5, 2.0)),
        _environment(),
        SPOT,
        DirectionalLight((-0.9, 0.1, 0.2)),
    ],
}


def magnitude(asset: Asset, lights: Sequence[Light], of: np.ndarray | None = None) -> np.ndarray:
    """Sum over lights of color times attenuation times sum |c_i R_i|, (H, W, 3): what tolerances are relative to."""
    c = np.abs(asset.coefficients()) if of is None else of  # (K, H, W, 3)
    total = np.einsum("khwc,kc->hwc", c, projected_weights(asset, lights))
    for light in (moved(light, asset.asset_from_world) for light in lights):
        if isinstance(light, PointLight):
            positions = asset.images["position"]
            weights, _ = receiver_weights(asset, light, positions)
            strength = attenuation(np.linalg.norm(np.array(light.position) - positions, axis=-1), light)  # without the cone
            total += np.einsum("khwc,hwk->hwc", c, weights * strength[..., None]) * light.color
    return total


def tolerance(asset: Asset, lights: Sequence[Light], target: str = "float") -> np.ndarray:
    """The contract for one asset and set of lights, (H, W, 3)."""
    bound = magnitude(asset, lights)
    ambient = asset.images.get("ambient", 0)
    if target == "half":
        return HALF * (bound + ambient) + HALF_TINY
    allowed = FLOAT * bound + FINAL * ambient
    if asset.encoding == "uint8":
        bias = asset.bias[:, None, None]
        allowed += DECODING * magnitude(asset, lights, np.abs(asset.coefficients() - bias) + np.abs(bias))
    return allowed


@pytest.fixture(scope="module")
def relighter_of(context: Any, make_asset: Callable[..., Asset]) -> Iterator[Callable[[int, str, str], tuple[Asset, Relighter]]]:
    made: dict[tuple[int, str, str], tuple[Asset, Relighter]] = {}

    def get(k: int, encoding: str, target: str) -> tuple[Asset, Relighter]:
        if (k, encoding, target) not in made:
            asset = make_asset(k, encoding)
            made[k, encoding, target] = asset, Relighter(asset, target=target, context=context)  # type: ignore[arg-type]
        return made[k, encoding, target]

    yield get
    for _, relighter in made.values():
        relighter.close()


@pytest.mark.parametrize("multipass", [False, True], ids=["single", "multi"])
@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("k", KS)
def test_equals_numpy(relighter_of: Callable[..., Any], k: int, encoding: str, kind: str, multipass: bool) -> None:
    asset, relighter = relighter_of(k, encoding, "float")
    lights = LIGHTS[kind]
    expected = methods.relight(asset, lights)
    assert expected.max() > 0
    found = relighter.relight(lights, multipass=multipass)
    assert found.dtype == np.float32
    np.testing.assert_array_less(np.abs(found - expected), tolerance(asset, lights) + np.finfo(np.float32).tiny)


@pytest.mark.parametrize("multipass", [False, True], ids=["single", "multi"])
@pytest.mark.parametrize("kind", LIGHTS)
def test_half_target_is_within_two_half_steps(relighter_of: Callable[..., Any], kind: str, multipass: bool) -> None:
    asset, relighter = relighter_of(25, "half", "half")
    lights = LIGHTS[kind]
    found = relighter.relight(lights, multipass=multipass)
    assert (np.abs(found - methods.relight(asset, lights)) <= tolerance(asset, lights, "half")).all()


def point_lights(count: int) -> list[Light]:
    """Points and spots of every kind, all over the receivers."""
    rng = np.random.default_rng(9)
    made: list[Light] = []
    for i in range(count):
        position, color = rng.uniform(-1, 1, 3) * [1.5, 1.5, 1] + [0, 0, 1.2], rng.random(3) / count
        falloff = ("linear", "inverse-square")[i % 2]
        if i % 3 == 2:
            made.append(SpotLight(tuple(position), tuple(color), 1.5, falloff, direction=tuple(-position), inner=0.2, outer=0.9))  # type: ignore[arg-type]
        else:
            made.append(PointLight(tuple(position), tuple(color), 0.8, falloff))  # type: ignore[arg-type]
    return made


@pytest.mark.parametrize("far", [False, True], ids=["point_lights", "with-far"])
@pytest.mark.parametrize("count", [2, 5, 16, 19])
def test_many_point_lights_at_once_equal_numpy(relighter_of: Callable[..., Any], count: int, far: bool) -> None:
    asset, relighter = relighter_of(25, "half", "float")
    lights = point_lights(count) + (LIGHTS["directional"] + LIGHTS["environment"] if far else [])
    found = relighter.relight(lights)
    assert (np.abs(found - methods.relight(asset, lights)) <= tolerance(asset, lights)).all()
    assert (np.abs(relighter.relight(lights, multipass=True) - found) <= 2 * tolerance(asset, lights)).all()


@pytest.mark.parametrize("functions", ["table", "formula"])
def test_loops_of_gpus_give_what_those_of_software_do(context: Any, make_asset: Callable[..., Asset], functions: Any) -> None:
    """A light keeps its place in them, whether it shines on a receiver or not."""
    asset = make_asset(25, "half")
    lights = [*point_lights(3), SpotLight((0, 0, 2.0), direction=(0, 0, -1), inner=0.05, outer=0.1), *point_lights(2)]
    counts = (1, 3, len(lights))
    with Relighter(asset, context=context, functions=functions) as relighter:
        passes: Any = relighter._passes
        passes._loops = {}
        by_software = [relighter.relight(lights[:count]) for count in counts]
        passes._loops = {"SRBF_UNROLLED": 1}
        for count, expected in zip(counts, by_software, strict=True):
            assert (np.abs(relighter.relight(lights[:count]) - expected) <= tolerance(asset, lights[:count])).all()


def test_point_lights_by_formula_are_as_near_as_the_table_is(context: Any, make_asset: Callable[..., Asset]) -> None:
    """numpy reads the table, which is within 2^-12 of the formula; a sharper truth is R itself."""
    asset = make_asset(25, "float")
    lights = point_lights(3)
    exact = np.zeros((asset.height, asset.width, 3))
    for light in lights:
        assert isinstance(light, PointLight)
        unit, strength = light_vectors(light, asset.images["position"])
        weights = asset.basis.evaluate(unit.reshape(-1, 3)).reshape(*unit.shape[:2], -1)
        exact += np.einsum("khwc,hwk->hwc", asset.coefficients(), weights) * strength[..., None] * light.color
    with Relighter(asset, context=context, functions="formula") as relighter:
        assert (np.abs(relighter.relight(lights) - np.maximum(exact, 0)) <= tolerance(asset, lights)).all()
        alone = relighter.relight(lights[:1])
    with Relighter(asset, context=context) as relighter:
        by_table = relighter.relight(lights[:1])
    assert 0 < np.abs(alone - by_table).max() < 2.0**-12 * np.abs(asset.coefficients()).sum(axis=0).max()


@pytest.mark.parametrize("units", [1, 3, 8])
def test_any_number_of_units_gives_the_same_image(relighter_of: Callable[..., Any], units: int) -> None:
    asset, relighter = relighter_of(25, "half", "float")
    lights = LIGHTS["several"]
    found = relighter.relight(lights, multipass=True, units=units)
    assert (np.abs(found - methods.relight(asset, lights)) <= tolerance(asset, lights)).all()


@pytest.mark.parametrize("spread", [0.12, 0.22], ids=["narrowest", "mean"])
def test_two_hundred_maps(context: Any, make_asset: Callable[..., Asset], spread: float) -> None:
    asset = make_asset(200, "half", spread=spread)
    with Relighter(asset, context=context) as relighter:
        for lights in (LIGHTS["several"], LIGHTS["point-linear"]):
            assert (np.abs(relighter.relight(lights) - methods.relight(asset, lights)) <= tolerance(asset, lights)).all()


def test_more_maps_than_uniforms_hold_take_several_passes(context: Any, make_asset: Callable[..., Asset], monkeypatch: Any) -> None:
    limits = replace(Limits.of(context), fragment_vectors=62)  # 30 to fill
    monkeypatch.setattr(Limits, "of", staticmethod(lambda _: limits))
    asset = make_asset(25, "uint8")
    with Relighter(asset, context=context) as relighter:
        lights = LIGHTS["several"]
        assert [relighter._passes.layers_per_pass(point_lights) for point_lights in (0, 1, 2)] == [30, 6, 5]
        assert (np.abs(relighter.relight(lights) - methods.relight(asset, lights)) <= tolerance(asset, lights)).all()


def test_no_light_is_exactly_ambient(context: Any, make_asset: Callable[..., Asset]) -> None:
    with_ambient, without = make_asset(ambient=True), make_asset()
    assert (relight(with_ambient, []) == with_ambient.images["ambient"]).all()
    with Relighter(without, context=context) as relighter:
        assert (relighter.relight([]) == 0).all()


def test_ambient_is_added_after_the_clamp(context: Any, make_asset: Callable[..., Asset]) -> None:
    asset, lights = make_asset(ambient=True), LIGHTS["several"]
    with Relighter(asset, context=context) as relighter:
        found = relighter.relight(lights)
    assert (np.abs(found - methods.relight(asset, lights)) <= tolerance(asset, lights) + FINAL * found).all()
    assert (found >= asset.images["ambient"]).all()


def test_lights_add_up_before_the_clamp(context: Any, make_asset: Callable[..., Asset]) -> None:
    """One light of response -2, another of +3: together 1, not 3."""
    coefficients = np.zeros((7, 4, 5, 3), np.float32)
    asset = make_asset(7, height=4, width=5, coefficients=coefficients)
    basis = asset.basis
    asset.stored[...] = np.linalg.solve(basis.evaluate(basis.centers), [-2, 3, 0, 0, 0, 0, 0])[:, None, None, None]
    lights = [DirectionalLight(tuple(basis.centers[i])) for i in (0, 1)]  # type: ignore[arg-type]
    table_error = 2.0**-12 * 2 * np.abs(asset.stored[:, 0, 0, 0]).sum()  # of R, two lights
    with Relighter(asset, context=context) as relighter:
        assert (relighter.relight(lights[:1]) == 0).all()
        np.testing.assert_allclose(relighter.relight(lights), 1, atol=table_error)


def test_every_texel_stays_in_its_row_and_column(context: Any, make_asset: Callable[..., Asset]) -> None:
    hot = np.zeros((7, 6, 11, 3), np.float32)
    hot[:, 1, 8] = 1
    asset = make_asset(7, "half", 6, 11, coefficients=hot)
    asset.images["ambient"] = np.zeros((6, 11, 3), np.float32)
    asset.images["ambient"][4, 2] = 0.25
    with Relighter(asset, context=context) as relighter:
        for kind in ("directional", "point-linear"):
            for multipass in (False, True):
                lit = relighter.relight(LIGHTS[kind], multipass=multipass)
                assert set(zip(*np.nonzero(lit.any(axis=2)), strict=True)) == {(1, 8), (4, 2)}


def test_positions_stay_in_their_row_and_column(context: Any, make_asset: Callable[..., Asset]) -> None:
    asset = make_asset(7, height=6, width=11, coefficients=np.ones((7, 6, 11, 3), np.float32))
    near = PointLight(tuple(asset.images["position"][1, 8].astype(float)), a0=1e-3, falloff="inverse-square")  # type: ignore[arg-type]
    with Relighter(asset, context=context) as relighter:
        lit = relighter.relight([near])
    assert np.unravel_index(lit[..., 0].argmax(), lit.shape[:2]) == (1, 8)
    assert (np.abs(lit - methods.relight(asset, [near])) <= tolerance(asset, [near])).all()  # a receiver in the light included


def test_a_point_light_far_from_the_origin_keeps_its_digits(context: Any, make_asset: Callable[..., Asset]) -> None:
    """Single precision would place this light to within 0.1 mm, 3e-4 of its distance."""
    asset = make_asset(25)
    offset = np.array([2000.0, -3000.0, 500.0])
    asset.images["position"] = (asset.images["position"] + offset).astype(np.float32)
    point_light = PointLight(tuple(offset + np.array([0.40001, -0.2, 0.70003])))  # type: ignore[arg-type]
    with Relighter(asset, context=context) as relighter:
        found = relighter.relight([point_light])
    assert (np.abs(found - methods.relight(asset, [point_light])) <= tolerance(asset, [point_light])).all()


def test_a_moved_asset_carries_its_lights(context: Any, make_asset: Callable[..., Asset]) -> None:
    asset = make_asset(7)
    turn = np.array([[0, -2, 0, 0.3], [2, 0, 0, -0.1], [0, 0, 2, 0.2], [0, 0, 0, 1]], float)
    asset.manifest["asset_from_world"] = turn.tolist()
    lights = LIGHTS["several"]
    with Relighter(asset, context=context) as relighter:
        found = relighter.relight(lights)
    assert (np.abs(found - methods.relight(asset, lights)) <= tolerance(asset, lights)).all()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["directional", "environment", "point-linear", "spot"])
def test_linear_in_the_color_of_a_light(relighter_of: Callable[..., Any], kind: str, seed: int) -> None:
    """Equal before the clamp; clamping is monotone and 1-Lipschitz, so a scaled color scales the clamped image too."""
    asset, relighter = relighter_of(25, "float", "float")
    light = LIGHTS[kind][0]
    factor = np.random.default_rng(seed).uniform(0.1, 9, 3)
    scaled = [replace(light, color=tuple(factor * light.color))]
    difference = np.abs(relighter.relight(scaled) - relighter.relight([light]) * factor)
    assert (difference <= tolerance(asset, scaled)).all()


def test_frames_do_not_leak_into_each_other(relighter_of: Callable[..., Any]) -> None:
    _, relighter = relighter_of(7, "half", "float")
    first = relighter.relight(LIGHTS["several"])
    relighter.relight(LIGHTS["spot"], multipass=True)
    assert (relighter.relight(LIGHTS["several"]) == first).all()


def test_point_lights_need_positions(context: Any, make_asset: Callable[..., Asset]) -> None:
    asset = make_asset(position=False)
    with Relighter(asset, context=context) as relighter:
        assert relighter.relight(LIGHTS["directional"]).max() > 0
        with pytest.raises(InputError, match="position map"):
            relighter.relight(LIGHTS["spot"])


def test_harmonics_relight_far_lights_and_refuse_point_lights(context: Any, make_asset: Callable[..., Asset]) -> None:
    asset = make_asset(9)
    asset.manifest["basis"] = {"kind": "spherical-harmonics"}
    asset.tables.clear()
    lights = [*LIGHTS["directional"], *LIGHTS["environment"]]
    with Relighter(asset, context=context) as relighter:
        bound = np.einsum("khwc,kc->hwc", np.abs(asset.coefficients()), np.abs(projected_weights(asset, lights)))
        for multipass in (False, True):
            found = relighter.relight(lights, multipass=multipass)
            assert found.max() > 0
            assert (np.abs(found - methods.relight(asset, lights)) <= FLOAT * bound).all()
        with pytest.raises(InputError, match="found spherical-harmonics; relight them by numpy"):
            relighter.relight(LIGHTS["spot"])


@pytest.mark.parametrize(
    ("limit", "text"), [({"array_layers": 5}, "at most 5 layers .* found 7"), ({"texture_size": 8}, "at most 8 texels a side")]
)
def test_an_asset_too_large_for_the_gpu_is_refused(
    context: Any, make_asset: Callable[..., Asset], monkeypatch: Any, limit: dict[str, int], text: str
) -> None:
    limits = replace(Limits.of(context), **limit)
    monkeypatch.setattr(Limits, "of", staticmethod(lambda _: limits))
    with pytest.raises(ShaderError, match=text), Relighter(make_asset(7), context=context) as relighter:
        relighter.relight(LIGHTS["directional"])


def test_wrong_settings_are_refused(context: Any, make_asset: Callable[..., Asset]) -> None:
    asset = make_asset()
    with pytest.raises((InputError, TypeError)):  # TypeError where annotations are checked at run time
        Relighter(asset, target="double", context=context)  # type: ignore[arg-type]
    with Relighter(asset, context=context) as relighter, pytest.raises(InputError, match="1 to 8 texture units"):
        relighter.relight([], multipass=True, units=9)
    asset.manifest["method"] = "hologram"
    with pytest.raises(InputError, match="relighting-map.*found 'hologram'"):
        Relighter(asset, context=context)


def test_closing_twice_is_harmless(context: Any, make_asset: Callable[..., Asset]) -> None:
    relighter = Relighter(make_asset(), context=context)
    relighter.close()
    relighter.close()
    with Relighter(make_asset(), context=context) as other:  # a context that was lent is still there
        assert other.relight([]).shape == (9, 14, 3)
