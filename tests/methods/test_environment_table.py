"""Environment maps of transfer assets without rays: against rays, the form factors, and a room that is closed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_rooms import Room, room_of_surfels
from typer.testing import CliRunner

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cli import app
from srbf.errors import InputError, ManifestError
from srbf.evaluation.environment_errors import environment_errors, random_environments
from srbf.info import describe_asset
from srbf.io import files
from srbf.io.image import read_image, write_image
from srbf.lights import AreaLight, DirectionalLight, EnvironmentLight, PointLight, moved
from srbf.methods import linear_response
from srbf.methods.environment_table import has_environment_table, without_environment_table
from srbf.methods.surface_changes import with_albedo
from srbf.methods.transfer import Transfer
from srbf.visibility.transfer_operator import OPERATOR_FILE, TransferOperator

pytest.importorskip("embreex")
pytest.importorskip("sklearn")

SETTINGS = Transfer(clusters=4, components=12, rank=48, surfels=120, editable=True, encoding="half")
ENVIRONMENT = random_environments(1, seed=3)[0]


@pytest.fixture(scope="module")
def capture(tmp_path_factory) -> Capture:
    """A room without a lid."""
    room = Room.box((3, 2, 2), 0.5, 0.6, lid=False)
    return room_of_surfels(tmp_path_factory.mktemp("environment") / "capture", replace(room, free=room.free[:80]), 200, tested=2)


@pytest.fixture(scope="module")
def asset(capture: Capture) -> Asset:
    with pytest.MonkeyPatch.context() as patch:
        for name in ("PLACED", "MOST_PLACED", "NEAR", "SPOTS"):
            patch.setattr(f"srbf.visibility.transfer_basis.{name}", 40)
        return SETTINGS.encode(capture)


def off(found: np.ndarray, truth: np.ndarray) -> float:
    return float(np.linalg.norm(found - truth) / np.linalg.norm(truth))


@pytest.mark.lengthy
def test_the_table_gives_what_the_form_factors_and_rays_give(asset: Asset, capture: Capture) -> None:
    errors = environment_errors(asset, capture, 4)
    assert errors["count"] == 4 and errors["relative_rmse"] <= errors["worst"]
    assert errors["relative_rmse"] < 0.03
    assert errors["rays"] < 0.08  # one ray per surfel and direction


def test_a_cell_of_the_environment_is_a_distant_light(asset: Asset) -> None:
    """A map that is bright in a few degrees alone, as a sun of its irradiance."""
    image = np.zeros((90, 180, 3), np.float32)
    image[20:23, 100:103] = 50.0
    elevation, azimuth = np.pi / 2 - 21.5 * np.pi / 90, (0.5 - 101.5 / 180) * 2 * np.pi
    toward = (np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation))
    strength = 50.0 * 9 * (np.pi / 90) ** 2 * np.cos(elevation)
    sun = linear_response(asset, [DirectionalLight(toward, (strength,) * 3)])
    assert off(linear_response(asset, [EnvironmentLight(image)]), sun) < 0.15


def test_light_adds_up_and_turns(asset: Asset) -> None:
    point = PointLight((1.0, 1.0, 1.0), falloff="inverse-square")
    both = linear_response(asset, [ENVIRONMENT, point])
    np.testing.assert_allclose(both, linear_response(asset, [ENVIRONMENT]) + linear_response(asset, [point]), atol=1e-4 * both.max())
    colored = linear_response(asset, [replace(ENVIRONMENT, color=(2.0, 1.0, 0.0))])
    np.testing.assert_allclose(colored[..., 0], 2 * linear_response(asset, [ENVIRONMENT])[..., 0], rtol=1e-4, atol=1e-5)
    assert not colored[..., 2].any()
    quarter = np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    rolled = replace(ENVIRONMENT, image=np.roll(ENVIRONMENT.image, -ENVIRONMENT.image.shape[1] // 4, axis=1))
    np.testing.assert_allclose(
        linear_response(asset, [moved(ENVIRONMENT, quarter)]), linear_response(asset, [rolled]), rtol=1e-3, atol=1e-4
    )


def test_no_rays_are_needed(asset: Asset, tmp_path: Path, monkeypatch) -> None:
    expected = linear_response(asset, [ENVIRONMENT])
    asset.save(tmp_path / "asset")
    opened = Asset.open(tmp_path / "asset")
    np.testing.assert_array_equal(linear_response(opened, [ENVIRONMENT]), expected)
    facts = describe_asset(opened, tmp_path / "asset")["environment"]
    assert 100 < facts["cells"] < facts["of"] and facts["bytes"] == 48 * facts["cells"] * 6
    monkeypatch.setattr("srbf.methods.lights_inside_maps.has_embree", lambda: False)
    np.testing.assert_array_equal(linear_response(opened, [ENVIRONMENT]), expected)
    with pytest.raises(InputError, match="without embreex"):
        linear_response(opened, [ENVIRONMENT, AreaLight((1.0, 1.0, 1.0), (0.2, 0, 0), (0, 0.2, 0))])


def test_cells_that_no_map_has_are_refused(asset: Asset, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    manifest = files.read_json(tmp_path / "asset" / "asset.json")
    manifest["environment_transfer"]["cells"][-1] = manifest["environment_transfer"]["side"] ** 2
    files.write_json(tmp_path / "asset" / "asset.json", manifest)
    with pytest.raises(ManifestError, match="expected cells below"):
        Asset.open(tmp_path / "asset")


def test_a_repainted_room_takes_rays(asset: Asset) -> None:
    painted = with_albedo(asset, {"Red wall": (0.1, 0.2, 0.8)})
    assert has_environment_table(asset) and not has_environment_table(painted)
    blue = linear_response(painted, [ENVIRONMENT])
    assert blue[..., 2].mean() > 1.1 * linear_response(asset, [ENVIRONMENT])[..., 2].mean()


def test_captures_that_know_no_environment_are_relit_by_rays(asset: Asset, capture: Capture, tmp_path: Path) -> None:
    """Those of older bakes, and of closed rooms, which have nothing more in their files."""
    operator = TransferOperator.read(capture.folder)
    older = replace(operator, environment=None)
    older.write(tmp_path, "made")
    with np.load(tmp_path / OPERATOR_FILE) as stored:
        assert not [name for name in stored if "environment" in name]
    read = TransferOperator.read(tmp_path)
    assert read.environment is None
    np.testing.assert_array_equal(read.exchange.toarray(), operator.exchange.toarray())
    with pytest.raises(InputError, match="surfels that see the environment"):
        environment_errors(without_environment_table(asset), capture)
    assert off(linear_response(without_environment_table(asset), [ENVIRONMENT]), linear_response(asset, [ENVIRONMENT])) < 0.08


@pytest.mark.lengthy
def test_relight_and_evaluate_use_the_table(asset: Asset, capture: Capture, tmp_path: Path) -> None:
    folder, environment = str(tmp_path / "asset"), str(tmp_path / "environment.exr")
    asset.save(Path(folder))
    write_image(Path(environment), ENVIRONMENT.image, "float")
    images: list[np.ndarray] = []
    for more in ([], ["--shadows", "ray"]):
        out = tmp_path / f"{len(images)}.exr"
        assert (
            CliRunner().invoke(app, ["relight", folder, "--environment", environment, "--direct", "none", "-o", str(out), *more]).exit_code
            == 0
        )
        images.append(read_image(out, 3)[asset.covered])
    table, rays = images
    np.testing.assert_allclose(table, linear_response(asset, [ENVIRONMENT])[asset.covered], rtol=1e-4, atol=1e-5)
    assert 0 < off(table, rays) < 0.08
    told = CliRunner().invoke(app, ["evaluate", folder, str(capture.folder)]).stdout
    assert "bounces of 8 half bright environments: relative 0.0" in told
