"""Traced form factors of a closed room, by closed forms: furnace, energy, reciprocity, linearity, no bounces, a room that emits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_rooms import Room, divided, room_of_surfels

from srbf.capture import Capture
from srbf.solve.radiosity import Bounces
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.receivers import Receivers
from srbf.visibility.surface_cells import Fragments
from srbf.visibility.surfels import surfels_of
from srbf.visibility.transfer_basis import exchange_of
from srbf.visibility.transfer_operator import TransferOperator

pytest.importorskip("embreex")

BOX = Room.box((2, 1.5, 1.5), 0.5)
NOISE = 0.02  # of 3072 rays, in the rms over receivers, and of corners that no ray resolves


@pytest.fixture(scope="module")
def capture(tmp_path_factory) -> Capture:
    return room_of_surfels(tmp_path_factory.mktemp("closed") / "capture", BOX, 150, tested=0)


@pytest.fixture(scope="module")
def operator(capture: Capture) -> TransferOperator:
    return TransferOperator.read(capture.folder)


def covered(operator: TransferOperator) -> np.ndarray:
    return np.diff(operator.receivers.indptr) > 0


@pytest.mark.lengthy
@pytest.mark.parametrize("albedo", [0.3, 0.8])
def test_a_furnace(operator: TransferOperator, albedo: float) -> None:
    """Irradiance 1 everywhere, all walls of one albedo: receivers get rho / (1 - rho) more."""
    gray = replace(operator, cells=replace(operator.cells, albedo=np.full_like(operator.cells.albedo, albedo)))
    _, bounces = exchange_of(gray)
    found = operator.receivers @ bounces[0].radiosity(np.ones((len(gray.objects), 1), np.float32))
    np.testing.assert_allclose(found[covered(operator), 0], albedo / (1 - albedo), rtol=NOISE)


def test_nothing_is_lost_and_what_is_exchanged_is_reciprocal(operator: TransferOperator) -> None:
    exchange, bounces = exchange_of(operator)
    np.testing.assert_allclose(exchange.sum(axis=1), 1, atol=1e-3)
    flux = operator.cells.areas[:, None] * exchange
    np.testing.assert_allclose(flux, flux.T, atol=1e-3 * flux.max())
    direct = np.random.default_rng(0).uniform(size=(len(operator.objects), 1)).astype(np.float32)
    rho, areas = operator.cells.albedo[:, 0], operator.cells.areas
    arriving = direct + exchange @ bounces[0].radiosity(direct)
    assert (areas * (1 - rho)) @ arriving[:, 0] == pytest.approx(float(areas @ direct[:, 0]), rel=2e-3)  # all of it is absorbed


def test_without_bounces_or_albedo_nothing_arrives(operator: TransferOperator) -> None:
    direct = np.ones((len(operator.objects), 2), np.float32)
    black = replace(operator, cells=replace(operator.cells, albedo=np.zeros_like(operator.cells.albedo)))
    for bounces in (exchange_of(operator, 0)[1], exchange_of(black)[1]):
        assert not (operator.receivers @ bounces[0].radiosity(direct)).any()


def test_light_adds_up(operator: TransferOperator) -> None:
    exchange, _ = exchange_of(operator)
    bounces = Bounces(exchange, operator.cells.albedo[:, 0].astype(np.float64), 3)
    lights = np.random.default_rng(1).uniform(size=(len(operator.objects), 3)).astype(np.float32)
    found = operator.receivers @ bounces.radiosity(lights)
    weights = np.array([2.0, 0.5, 3.0], np.float32)
    np.testing.assert_allclose(found @ weights, (operator.receivers @ bounces.radiosity((lights @ weights)[:, None]))[:, 0], rtol=1e-4)


@pytest.mark.lengthy
def test_a_black_room_that_emits_radiance_1_gives_irradiance_pi(capture: Capture) -> None:
    """By form factors to points of what emits where that is far, and by rays where it is near."""
    corners = divided(BOX.corners, 0.3)
    black, light = np.zeros((len(corners), 3), np.float32), np.ones((2, len(corners), 3), np.float32)
    numbers = np.zeros(len(corners), np.int64)
    surfels = surfels_of(Fragments(corners, black), numbers, EmbreeTriangles(BOX.corners), BOX.free, 0.2, 400, light)
    operator = TransferOperator.traced(surfels, Receivers.of(capture), is_lightmap=False)
    found = np.pi * (operator.receivers @ surfels.emission)[covered(operator)]
    assert len(found) == len(BOX.places)
    np.testing.assert_allclose(found, np.pi, rtol=0.05)
    assert found.mean() == pytest.approx(np.pi, rel=5e-3)
