"""`--error` of transfer: sizes that keep to an error, measured by lights that the fit does not see, and a line where none does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_rooms import Room, room_of_surfels

from srbf.capture import Capture
from srbf.evaluation.errors_by_role import evaluate
from srbf.fitting.options import fit
from srbf.lights import PointLight
from srbf.methods import linear_response
from srbf.solve.radiosity import Bounces, reciprocal
from srbf.visibility import transfer_basis
from srbf.visibility.cloud_lights import CloudLights
from srbf.visibility.received import ReceivedLight
from srbf.visibility.transfer_operator import TransferOperator

pytest.importorskip("embreex")
pytest.importorskip("sklearn")
pytestmark = pytest.mark.slow

BOX = Room.box((2, 1.5, 1.5), 0.25, 0.6)


@pytest.fixture(scope="module")
def capture(tmp_path_factory) -> Capture:
    """With four validation lights."""
    return room_of_surfels(tmp_path_factory.mktemp("surfels") / "capture", BOX, 400, tested=0)


@pytest.fixture(autouse=True)
def fewer_lights(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shapes of a small room need few lights."""
    for name, count in (("PLACED", 120), ("MOST_PLACED", 120), ("NEAR", 40), ("SPOTS", 40)):
        monkeypatch.setattr(transfer_basis, name, count)


def test_the_error_on_validation_lights_is_kept_to(capture: Capture) -> None:
    said: list[str] = []
    asset = fit(capture, budget=13, error=0.15, say=said.append)
    found = evaluate(asset, capture, roles=("validation",))["validation"]["relative_rmse"]
    told = asset.manifest["source"]["fit"]["choice"]
    assert found <= 0.15 and told["error"] == pytest.approx(found, rel=0.02)
    assert "4 validation lights" in said[-1] and f"{told['error']:.2%}" in said[-1] and not any("expected" in line for line in said)
    assert asset.bytes_per_texel()["directional"] < 13, "fewer components are enough"


def test_random_lights_against_the_form_factors_where_none_are_held_out(capture: Capture) -> None:
    """By other random lights, as the choice cannot know them."""
    said: list[str] = []
    untested = replace(capture, lights=(), manifest={**capture.manifest, "lights": []})
    asset = fit(untested, method="transfer", clusters=8, surfels=300, error=0.1, say=said.append)
    assert asset.manifest["surfel_transfer"]["surfels"] > 200, "as many as are asked for"
    assert "random lights, against uncompressed form factors" in said[-1]
    operator, inside = TransferOperator.read(capture.folder), CloudLights.of(capture)
    received = ReceivedLight(operator.cells, inside.occluders)
    exchange = reciprocal(operator.exchange.toarray(), operator.cells.areas)
    bounces = [Bounces(exchange, operator.cells.albedo[:, c].astype(np.float64)) for c in range(3)]
    lost = power = 0.0
    for place in np.random.default_rng(9).uniform(0.15, 0.85, (12, 3)) * [2, 1.5, 1.5]:
        light = PointLight(tuple(place), falloff="inverse-square")
        direct = received.irradiance(light)[:, :1].astype(np.float32)
        exact = np.concatenate([operator.receivers @ one.radiosity(direct) for one in bounces], axis=1)
        found = linear_response(asset, [light]).reshape(-1, 3)
        covered = capture.coverage().ravel() > 0.5
        lost += float(((found - exact)[covered] ** 2).sum())
        power += float((exact[covered] ** 2).sum())
    assert np.sqrt(lost / power) <= 0.12  # of other lights


def test_what_cannot_be_reached_is_said_and_the_nearest_taken(capture: Capture) -> None:
    said: list[str] = []
    asset = fit(capture, budget=5, error=0.002, say=said.append)
    assert asset.bytes_per_texel()["directional"] == 5
    lines = [line for line in said if line.startswith("expected an error of 0.20%")]
    assert len(lines) == 2 and "4 validation lights, found" in lines[0] and "raise `components`" in lines[1]
    assert "against uncompressed form factors" in said[-1]
