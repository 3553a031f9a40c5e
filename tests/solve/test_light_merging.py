"""Merged lights: what complete linkage promises, means, and walls."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.errors import InputError
from srbf.solve.light_merging import Mean, largest_differences, merge_tree, merged, metric_weights

RNG = np.random.default_rng(0)
LIGHTS = RNG.uniform((-1, 0, 0), (1, 1, 1), (60, 3))
RECEIVERS = RNG.uniform((-1, 0, 0), (1, 1, 0), (80, 3))
APART = np.linalg.norm(RECEIVERS[:, None] - LIGHTS, axis=2)
RESPONSES = (np.array([1.0, 0.6, 0.3]) / (0.2 + APART**2)[..., None]).astype(np.float32)  # (P, L, 3)
SAME_ROOM = (LIGHTS[:, None, 0] < 0) == (LIGHTS[None, :, 0] < 0)
ALL = np.ones((60, 60), bool)
DIFFERENCES = largest_differences(RESPONSES)
W1, W2 = metric_weights(LIGHTS, DIFFERENCES)
METRIC = W1 * np.linalg.norm(LIGHTS[:, None] - LIGHTS, axis=2) + W2 * DIFFERENCES
ROUNDING = 1e-6  # responses are float32


def test_differences_are_the_largest_over_receivers() -> None:
    expected = np.linalg.norm(RESPONSES[:, :, None] - RESPONSES[:, None], axis=3).max(axis=0)
    np.testing.assert_allclose(DIFFERENCES, expected, atol=ROUNDING)
    functions = np.stack([RESPONSES, 2 * RESPONSES], axis=3)  # (P, L, 3, 2)
    np.testing.assert_allclose(largest_differences(functions), np.sqrt(5) * expected, atol=10 * ROUNDING)


def test_weights_make_the_largest_terms_one_half() -> None:
    assert W1 * np.linalg.norm(LIGHTS[:, None] - LIGHTS, axis=2).max() == pytest.approx(0.5)
    assert W2 * DIFFERENCES.max() == pytest.approx(0.5)
    assert metric_weights(LIGHTS[:1], np.zeros((1, 1))) == (1.0, 1.0)


@pytest.mark.parametrize("threshold", [0.02, 0.1, 0.3, 0.7])
@pytest.mark.parametrize("visible", [ALL, SAME_ROOM])
def test_in_a_group_all_pairs_are_close_and_no_two_groups_may_merge(threshold, visible) -> None:
    """The article's rule, both halves: complete linkage, until every pair of groups has a pair of lights that is not close."""
    groups = merge_tree(LIGHTS, DIFFERENCES, visible, W1, W2).groups(threshold)
    close = (threshold > METRIC) & visible
    same = groups[:, None] == groups
    assert close[same & ~np.eye(60, dtype=bool)].all()
    for one in range(groups.max() + 1):
        for two in range(one):
            assert not close[np.ix_(groups == one, groups == two)].all()


def test_the_slow_twin_merges_the_same() -> None:
    """Greedy agglomeration pair by pair, as the article tells it."""
    clusters, metric = [[i] for i in range(60)], np.where(SAME_ROOM, METRIC, np.inf)
    while len(clusters) > 1:
        far = {(a, b): metric[np.ix_(clusters[a], clusters[b])].max() for a in range(len(clusters)) for b in range(a)}
        a, b = min(far, key=lambda pair: far[pair])
        if far[a, b] >= 0.25:
            break
        clusters[b] += clusters.pop(a)
    groups = merge_tree(LIGHTS, DIFFERENCES, SAME_ROOM, W1, W2).groups(0.25)
    assert {frozenset(members) for members in clusters} == {frozenset(np.flatnonzero(groups == g).tolist()) for g in set(groups.tolist())}


def test_larger_weights_are_a_lower_threshold() -> None:
    one = merge_tree(LIGHTS, DIFFERENCES, SAME_ROOM, 5 * W1, 5 * W2).groups(1.0)
    np.testing.assert_array_equal(one, merge_tree(LIGHTS, DIFFERENCES, SAME_ROOM, W1, W2).groups(0.2))


@pytest.mark.parametrize("count", [1, 2, 17, 59, 60, 100])
def test_a_number_of_groups(count: int) -> None:
    tree = merge_tree(LIGHTS, DIFFERENCES, ALL, W1, W2)
    groups = tree.into(count)
    assert len(set(groups.tolist())) == min(count, 60)


def test_rooms_without_a_door_never_share_a_light() -> None:
    for groups in (merge_tree(LIGHTS, DIFFERENCES, SAME_ROOM, W1, W2).into(1), merge_tree(LIGHTS, 0 * METRIC, SAME_ROOM, 0, 0).groups(9.0)):
        assert len(set(groups.tolist())) == 2
        assert SAME_ROOM[groups[:, None] == groups].all()


def test_permuted_lights_have_permuted_groups() -> None:
    order = np.random.default_rng(1).permutation(60)
    one = merge_tree(LIGHTS, DIFFERENCES, SAME_ROOM, W1, W2).into(20)
    two = merge_tree(LIGHTS[order], DIFFERENCES[np.ix_(order, order)], SAME_ROOM[np.ix_(order, order)], W1, W2).into(20)
    np.testing.assert_array_equal(one[order][:, None] == one[order], two[:, None] == two)
    assert list(dict.fromkeys(one.tolist())) == sorted(set(one.tolist()))  # numbered by their first members


def test_means_of_groups() -> None:
    groups = np.array([0, 1, 0, 2, 0, 1])
    values = np.random.default_rng(2).uniform(0.5, 2, (4, 6, 3))
    mean: Mean
    for mean, of in (("arithmetic", lambda x: x.mean(axis=1)), ("harmonic", lambda x: 1 / (1 / x).mean(axis=1))):
        expected = np.stack([of(values[:, groups == g]) for g in range(3)], axis=1)
        np.testing.assert_allclose(merged(values, groups, mean), expected)
        np.testing.assert_allclose(merged(7 * values, groups, mean), 7 * expected)
        np.testing.assert_allclose(merged(values, np.arange(6), mean), values)
    assert (merged(values, groups, "harmonic") <= merged(values, groups, "arithmetic") + 1e-12).all()
    np.testing.assert_allclose(merged(LIGHTS, np.zeros(60, int), "arithmetic"), LIGHTS.mean(axis=0, keepdims=True))


def test_harmonic_means_of_zeros_and_signs() -> None:
    groups = np.zeros(2, int)
    pairs = {(0.0, 3.0): 0.0, (0.0, 0.0): 0.0, (1e-310, 4.0): 0.0, (-1.0, -3.0): -1.5, (-1.0, 3.0): 1.0, (2.0, 2.0): 2.0, (0.0, -3.0): 0.0}
    for pair, expected in pairs.items():
        assert merged(np.array(pair)[:, None], groups)[0, 0] == pytest.approx(expected, abs=1e-300)


def test_what_has_no_meaning() -> None:
    np.testing.assert_array_equal(merge_tree(LIGHTS[:1], np.zeros((1, 1)), ALL[:1, :1], 1, 1).into(3), [0])
    with pytest.raises(InputError, match="finite"):
        merge_tree(LIGHTS, DIFFERENCES * np.nan, ALL, 1, 1)
    with pytest.raises(InputError, match="`count` of 1 or more"):
        merge_tree(LIGHTS, DIFFERENCES, ALL, 1, 1).into(0)
