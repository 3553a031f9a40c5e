"""The cloud's kernel: weights sum to one and never pass a wall, and fades make them continuous in time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from srbf.errors import InputError
from srbf.light_domain.cloud_kernel import CloudKernel, Fade, approach

ROUNDING = 1e-12
DOOR = (0.4, 0.6)  # y of the opening in the wall x = 0, m


def anywhere(origin: np.ndarray, target: np.ndarray) -> np.ndarray:
    return np.ones(len(origin), bool)


def same_side(origin: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Two rooms that the plane x = 0 parts, without a door."""
    return (origin[:, 0] < 0) == (target[:, 0] < 0)


def through_door(origin: np.ndarray, target: np.ndarray) -> np.ndarray:
    """The same rooms, with a door."""
    step = np.where(origin[:, 0] == target[:, 0], 1, target[:, 0] - origin[:, 0])
    y = origin[:, 1] - origin[:, 0] / step * (target[:, 1] - origin[:, 1])
    return same_side(origin, target) | ((y > DOOR[0]) & (y < DOOR[1]))


def cloud(count: int = 200, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform((-1, 0, 0), (1, 1, 1), (count, 3))


PLACES = np.random.default_rng(1).uniform((-1, 0, 0), (1, 1, 1), (60, 3))


@pytest.mark.parametrize("visible", [anywhere, same_side, through_door])
@pytest.mark.parametrize("nearest", [1, 2, 16, 500])
def test_weights_are_a_partition_of_unity(visible, nearest) -> None:
    found = CloudKernel(cloud(), visible, nearest).weights(PLACES)
    assert (found.weights >= 0).all()
    np.testing.assert_allclose(found.weights.sum(axis=1), 1, rtol=ROUNDING)
    np.testing.assert_allclose(found.dense(200).sum(axis=1), 1, rtol=ROUNDING)


def test_without_walls_it_is_the_kernel_over_the_nearest() -> None:
    """Against a slow twin, one place at a time."""
    lights = cloud()
    found = CloudKernel(lights, anywhere, 16).weights(PLACES).dense(len(lights))
    for place, weights in zip(PLACES, found, strict=True):
        distances, nearest = cKDTree(lights).query(place, 16)
        expected = np.zeros(len(lights))
        expected[nearest] = (1 - distances / distances[-1]) ** 4
        np.testing.assert_allclose(weights, expected / expected.sum(), atol=ROUNDING)


def test_rooms_without_a_door_never_share_a_light() -> None:
    lights = cloud()
    weights = CloudKernel(lights, same_side).weights(PLACES).dense(len(lights))
    other_side = (PLACES[:, None, 0] < 0) != (lights[None, :, 0] < 0)
    assert (weights[other_side] == 0).all()


def test_a_place_takes_the_nearest_that_it_sees_however_far() -> None:
    lights = cloud()
    lights[:195, 0] = -np.abs(lights[:195, 0])
    lights[195:, 0] = np.abs(lights[195:, 0])  # five lights alone in the room at the right
    places = PLACES.copy()
    places[:, 0] = np.abs(places[:, 0])
    found = CloudKernel(lights, same_side, 16).weights(places)
    np.testing.assert_array_equal(found.seen, 5)
    assert set(np.unique(found.lights[found.weights > 0])) <= set(range(195, 200))


def test_permuted_lights_have_permuted_weights() -> None:
    lights, order = cloud(), np.random.default_rng(2).permutation(200)
    one = CloudKernel(lights, through_door).weights(PLACES).dense(200)
    two = CloudKernel(lights[order], through_door).weights(PLACES).dense(200)
    np.testing.assert_allclose(two, one[:, order], atol=ROUNDING)


def test_moved_and_scaled_scenes_have_the_same_weights() -> None:
    lights = cloud()
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0] * 7
    one = CloudKernel(lights, anywhere).weights(PLACES).dense(200)
    two = CloudKernel(lights @ turn.T + 5, anywhere).weights(PLACES @ turn.T + 5).dense(200)
    np.testing.assert_allclose(one, two, atol=1e-9)


def test_equally_far_lights_have_equal_weights() -> None:
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    found = CloudKernel(corners, anywhere, 8).weights(np.full((1, 3), 0.5))
    np.testing.assert_allclose(found.weights, 1 / 8, rtol=ROUNDING)


def test_a_place_that_sees_nothing_takes_the_nearest_and_says_so() -> None:
    lights = cloud(20)
    found = CloudKernel(lights, lambda origin, target: np.zeros(len(origin), bool)).weights(PLACES)
    np.testing.assert_array_equal(found.seen, 0)
    np.testing.assert_array_equal(found.dense(20).argmax(axis=1), cKDTree(lights).query(PLACES)[1])
    np.testing.assert_allclose(found.dense(20).max(axis=1), 1)


def test_one_visible_light_has_all_the_weight() -> None:
    lights = cloud(20)
    found = CloudKernel(lights, lambda origin, target: (target == lights[7]).all(axis=1)).weights(PLACES)
    np.testing.assert_array_equal(found.seen, 1)
    np.testing.assert_array_equal(found.dense(20)[:, 7], 1)


def test_a_light_is_visible_from_its_own_place() -> None:
    """No ray of no length is asked for."""
    lights = cloud(20)

    def visible(origin: np.ndarray, target: np.ndarray) -> np.ndarray:
        assert (np.linalg.norm(target - origin, axis=1) > 0).all()
        return np.zeros(len(origin), bool)

    found = CloudKernel(lights, visible).weights(lights)
    np.testing.assert_array_equal(found.dense(20), np.eye(20))
    np.testing.assert_array_equal(found.seen, 1)
    np.testing.assert_array_equal(CloudKernel(lights[[0, 0]], visible).weights(lights[:1]).weights, [[0.5, 0.5]])


def test_no_places_give_no_weights_and_no_lights_an_error() -> None:
    assert CloudKernel(cloud(5), anywhere).weights(np.zeros((0, 3))).dense(5).shape == (0, 5)
    with pytest.raises(InputError, match="found none"):
        CloudKernel(np.zeros((0, 3)), anywhere)
    with pytest.raises(InputError, match="`nearest` of 1 or more"):
        CloudKernel(cloud(5), anywhere, 0)


# ---- fades ------------------------------------------------------------------------------------------------------------------

PATH = np.stack([np.linspace(-0.8, 0.8, 161), np.full(161, 0.5), np.full(161, 0.5)], axis=1)  # through the door


@pytest.mark.parametrize("seconds", [0.0, 0.5])
def test_at_rest_a_fade_ends_in_the_kernel(seconds: float) -> None:
    kernel = CloudKernel(cloud(), through_door)
    fade = Fade(kernel, seconds)
    fade.step(PATH[0], 0.1)
    for place in PLACES[:8]:
        at_rest = fade.step(place, 0.5)
        np.testing.assert_allclose(at_rest, kernel.weights(place[None]).dense(200)[0], atol=1e-9)


def test_faded_weights_sum_to_one_and_do_not_depend_on_the_frame_rate() -> None:
    kernel = CloudKernel(cloud(), through_door)
    slow, fast = Fade(kernel, 0.5), Fade(kernel, 0.5)
    for place in PATH[::20]:
        one = slow.step(place, 0.2)
        fast.step(place, 0.15)
        np.testing.assert_allclose(fast.step(place, 0.05), one, atol=1e-9)
        assert one.sum() == pytest.approx(1) and (one >= 0).all()


def test_fades_are_continuous_in_time() -> None:
    """Ten times as many steps are each about a tenth as large; the kernel alone jumps however small the steps."""
    kernel = CloudKernel(cloud(60), through_door)

    def largest(steps: int, faded: bool) -> float:
        places = np.stack([np.linspace(-0.8, 0.8, steps), np.full(steps, 0.5), np.full(steps, 0.5)], axis=1)
        if faded:
            fade = Fade(kernel, 1.0)
            weights = np.stack([fade.step(place, 4 / steps) for place in places])
        else:
            weights = kernel.weights(places).dense(60)
        return float(np.abs(np.diff(weights, axis=0)).sum(axis=1).max())

    assert largest(2000, True) < 0.2 * largest(200, True)
    assert largest(2000, False) > 0.5 * largest(200, False)


def test_where_nothing_is_visible_a_fade_holds() -> None:
    kernel = CloudKernel(cloud(), lambda origin, target: same_side(origin, target) & (origin[:, 1] < 1))
    fade = Fade(kernel, 0.1)
    before = fade.step(np.array([-0.5, 0.999, 0.5]), 0.0)
    after = fade.step(np.array([-0.5, 1.0, 0.5]), 1.0)
    np.testing.assert_allclose(after, before, atol=0.05)
    hidden = Fade(kernel, 0.1).step(np.array([-0.5, 1.2, 0.5]), 1.0)
    assert hidden.max() == 1 and hidden.sum() == 1


def test_opacity_moves_at_its_rate() -> None:
    np.testing.assert_allclose(approach(np.array([0.0, 1.0, 0.5]), np.array([1.0, 0.0, 0.45]), 0.1), [0.1, 0.9, 0.45])
    with pytest.raises(InputError, match="`dt` of 0 seconds or more"):
        Fade(CloudKernel(cloud(5), anywhere)).step(np.zeros(3), -1.0)
    with pytest.raises(InputError, match="`seconds` of 0 or more"):
        Fade(CloudKernel(cloud(5), anywhere), float("nan"))
