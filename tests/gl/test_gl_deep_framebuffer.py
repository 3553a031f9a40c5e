"""Deep framebuffers by shaders against numpy: every kind of light, their sums, lights that stay, parts of the passes alone."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_profiles import picture, uneven
from made_rooms import Room
from made_views import view_of_room, with_backs, with_lobes, with_specular_albedo, without_near
from typer.testing import CliRunner

from srbf import methods
from srbf.asset import Asset
from srbf.cli import app
from srbf.errors import InputError
from srbf.export import export
from srbf.gl.programs import Programs
from srbf.io.image import read_image
from srbf.light_profile import Profile
from srbf.lights import AreaLight, DirectionalLight, EnvironmentLight, Light, NamedLight, PointLight, SphereLight, SpotLight
from srbf.methods.deep_framebuffer import DeepFramebuffer
from srbf.relighting.relighter import Relighter
from srbf.visibility import near_passes
from srbf.visibility.pool_passes import PoolPasses
from srbf.visibility.received import ReceivedLight, occluders_of
from srbf.visibility.surface_cells import Cells
from srbf.visibility.surfel_light import SurfelLight

pytest.importorskip("embreex")

TOLERANCE = 2e-3  # of the largest value; 3e-4 measured, of bounces that are left out
BOUNCES = 5e-4  # these alone
EDGES, SHADOWED = 0.01, 0.02  # of the surfels, at the edge of a shadow, see a part of the light; of the largest value, with 700 surfels
LIGHTS: dict[str, Light] = {
    "point": PointLight((0.8, 0.7, 1.1), (1, 0.5, 0.2), falloff="inverse-square"),
    "linear": PointLight((2.4, 1.4, 0.6), (0.2, 0.5, 1), a0=2.0),
    "spot": SpotLight((2.0, 1.0, 1.5), falloff="inverse-square", direction=(0.2, 0, -1), inner=0.5, outer=0.8),
    "near a wall": PointLight((0.05, 1.2, 0.8), falloff="inverse-square"),
    "sphere": SphereLight((0.6, 1.2, 0.8), (0.2, 1, 0.4), size=0.1),
    "ies": PointLight((0.8, 0.7, 1.1), (1, 0.5, 0.2), falloff="inverse-square", direction=(1, 0.2, -0.3), roll=0.4, profile=uneven),
    "picture": SpotLight(
        (2.0, 1.0, 1.5),
        falloff="inverse-square",
        direction=(0.2, 0, -1),
        inner=0.5,
        outer=0.8,
        profile=Profile(picture(), projected=True),
    ),
    "area": AreaLight((1.5, 1, 1.7), u=(0.6, 0, 0), v=(0, -0.3, 0)),
    "sun": DirectionalLight((0.2, 0.1, 1)),
    "environment": EnvironmentLight(np.random.default_rng(3).uniform(0, 1, (8, 16, 3)).astype(np.float32)),
}


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    """Of a room without a lid."""
    room = Room.box((3, 2, 2), 0.25, 0.6, lid=False)
    return DeepFramebuffer().encode(view_of_room(tmp_path_factory.mktemp("view") / "capture", room, 700, 150, tested=0))


@pytest.fixture(scope="module")
def divided(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    """With a wall across that has a door."""
    room = Room.box((3, 2, 2), 0.25, 0.6, wall=(1.5, 0.6, 1.4), lid=False)
    return DeepFramebuffer().encode(view_of_room(tmp_path_factory.mktemp("divided") / "capture", room, 700, 150, tested=0))


@pytest.fixture(scope="module")
def relighter(asset: Asset, context: Any) -> Any:
    with Relighter(asset, context=context) as made:
        yield made


@pytest.mark.parametrize("kind", LIGHTS)
def test_a_light_is_that_of_numpy(asset: Asset, relighter: Relighter, kind: str) -> None:
    expected = methods.relight(asset, [LIGHTS[kind]])
    assert expected.max() > 0
    np.testing.assert_allclose(relighter.relight([LIGHTS[kind]]), expected, atol=TOLERANCE * expected.max())


@pytest.mark.parametrize("made", [with_lobes, with_specular_albedo], ids=["diffuse", "glossy"])
def test_lobes_gather_as_in_numpy(asset: Asset, context: Any, made: Any) -> None:
    """From surfels that reflect diffusely, and from those that reflect more toward lobes."""
    shiny = made(asset)
    expected = methods.relight(shiny, [LIGHTS["point"], LIGHTS["spot"]])
    assert expected.max() > 1.2 * methods.relight(asset, [LIGHTS["point"], LIGHTS["spot"]]).max()
    with Relighter(shiny, context=context) as relighter:
        np.testing.assert_allclose(relighter.relight([LIGHTS["point"], LIGHTS["spot"]]), expected, atol=TOLERANCE * expected.max())


@pytest.mark.parametrize("glossy", [False, True], ids=["diffuse", "glossy"])
def test_light_from_behind_passes_as_in_numpy(asset: Asset, context: Any, glossy: bool) -> None:
    opaque = with_lobes(asset) if glossy else asset
    expected = methods.relight(with_backs(opaque), [LIGHTS["point"], LIGHTS["spot"]])
    assert expected.mean() > 1.2 * methods.relight(opaque, [LIGHTS["point"], LIGHTS["spot"]]).mean()
    with Relighter(with_backs(opaque), context=context) as relighter:
        np.testing.assert_allclose(relighter.relight([LIGHTS["point"], LIGHTS["spot"]]), expected, atol=TOLERANCE * expected.max())


@pytest.fixture(params=["rays", "cubes"])
def by_rays(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Whether rays say what surfels and receivers see."""
    monkeypatch.setattr(PoolPasses, "shadow_rays", request.param == "rays")
    return bool(PoolPasses.shadow_rays)


@pytest.mark.lengthy
@pytest.mark.parametrize("kind", ["point", "spot", "near a wall", "sphere"])
def test_walls_shade_surfels_as_rays_say(divided: Asset, context: Any, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PoolPasses, "shadow_rays", False)
    lit: Any = LIGHTS[kind]
    light: Any = replace(lit, color=(1.0, 1.0, 1.0))
    pool = divided.tables["pool"]
    assert divided.scene is not None
    expected = ReceivedLight(Cells.of_image(pool[:2]), occluders_of(divided.scene)).irradiance(light)[:, 0]
    with context, ExitStack() as resources:
        texture = SurfelLight(Programs(context, resources), Cells.of_image(pool[:2]), divided.scene).draw(light)
        found = np.frombuffer(texture.read(), np.float32).reshape(-1, 4)[: len(expected), 0]
    off = np.abs(found - expected) > 1e-4 * expected.max()
    assert (expected == 0).mean() > 0.1 and off.mean() <= EDGES
    relit = methods.relight(divided, [light])
    with Relighter(divided, context=context) as relighter:
        np.testing.assert_allclose(relighter.relight([light]), relit, atol=SHADOWED * relit.max())


@pytest.mark.parametrize("kind", ["point", "spot", "near a wall", "sphere", "soft spot"])
def test_by_rays_it_is_numpy_s_picture_at_every_pixel(divided: Asset, context: Any, kind: str) -> None:
    lit: Any = LIGHTS["spot" if kind == "soft spot" else kind]
    light = replace(lit, size=0.1) if kind == "soft spot" else lit
    expected = methods.relight(divided, [light])
    with Relighter(divided, context=context) as relighter:
        np.testing.assert_allclose(relighter.relight([light]), expected, atol=BOUNCES * expected.max())


@pytest.mark.lengthy
def test_bright_surfels_light_as_in_numpy(context: Any, tmp_path: Path, by_rays: bool) -> None:
    """A light 3 cm off a wall of many surfels, behind a wall with a door, with lobes: less than all is seen of the bright ones."""
    room = Room.box((3, 2, 2), 0.25, 0.6, wall=(1.5, 0.6, 1.4), lid=False)
    asset = with_specular_albedo(DeepFramebuffer().encode(view_of_room(tmp_path / "capture", room, 8000, 150, tested=0)))
    light = PointLight((0.03, 1.1, 0.9), (1, 0.5, 0.2), falloff="inverse-square")
    bare = without_near(asset)
    for bounces in (1, 12):
        limited = replace(asset, manifest={**asset.manifest, "gather": {**asset.manifest["gather"], "bounces": bounces}})
        expected = methods.relight(limited, [light])
        with Relighter(limited, context=context) as relighter:
            np.testing.assert_allclose(relighter.relight([light]), expected, atol=TOLERANCE * expected.max())
    assert np.abs(methods.relight(bare, [light]) - expected).max() > 20 * TOLERANCE * expected.max()


@pytest.mark.parametrize("slots", [1, 64])
def test_what_is_seen_of_cells_is_kept(divided: Asset, context: Any, monkeypatch: pytest.MonkeyPatch, slots: int, by_rays: bool) -> None:
    """A light that comes back to a wall draws no cell a second time, unless the slot went to another cell meanwhile."""
    monkeypatch.setattr(near_passes, "SLOTS", slots)
    lights = [PointLight((place, 1.0, 0.9), falloff="inverse-square") for place in (0.05, 2.95, 0.05)]
    with Relighter(divided, context=context) as relighter:
        drawn = []
        for light in lights:
            expected = methods.relight(divided, [light])
            error = np.abs(relighter.relight([light]) - expected) / expected.max()
            if by_rays:
                assert error.max() < BOUNCES
            else:  # a shadow map's texels miss the wall's edge, which rays hit
                assert np.mean(error > TOLERANCE) < 0.01
            passes: Any = relighter._passes
            drawn.append(passes._near.drawn)
    assert 0 < drawn[0] < drawn[1]
    assert (drawn[2] > drawn[1]) == (slots == 1)


def test_lights_add_up_and_direct_light_joins_them(asset: Asset, relighter: Relighter) -> None:
    lights = [*LIGHTS.values(), LIGHTS["point"]]
    direct = np.random.default_rng(4).uniform(0, 0.1, (asset.height, asset.width, 3)).astype(np.float32)
    expected = methods.relight(asset, lights, direct)
    np.testing.assert_allclose(relighter.relight(lights, direct=direct), expected, atol=TOLERANCE * expected.max())
    assert not relighter.relight([]).any()


def test_a_light_that_stays_is_not_computed_again(asset: Asset, relighter: Relighter) -> None:
    passes: Any = relighter._passes
    assert isinstance(passes, PoolPasses)
    point, spot, around = (LIGHTS[name] for name in ("point", "spot", "environment"))
    relighter.relight([point, spot, around])
    before = passes.computed
    brighter = [replace(point, color=(0.1, 2.0, 3.0)), replace(around, color=(2.0, 1.0, 0.5)), spot]
    found = relighter.relight(brighter)
    assert passes.computed == before
    expected = methods.relight(asset, brighter)
    np.testing.assert_allclose(found, expected, atol=TOLERANCE * expected.max())
    moved: Any = point
    relighter.relight([replace(moved, position=(0.9, 0.7, 1.1)), spot, around])
    assert passes.computed == before + 1


@pytest.mark.parametrize("bounces", [0, 1, 3])
def test_bounces_are_those_of_the_scene(asset: Asset, context: Any, bounces: int) -> None:
    limited = replace(asset, manifest={**asset.manifest, "gather": {**asset.manifest["gather"], "bounces": bounces}})
    expected = methods.relight(limited, [LIGHTS["point"]])
    with Relighter(limited, context=context) as relighter:
        found = relighter.relight([LIGHTS["point"]])
    np.testing.assert_allclose(found, expected, atol=TOLERANCE * max(expected.max(), 1e-9))
    assert bool(found.any()) == (bounces > 0)


def test_irradiance_needs_no_albedo(asset: Asset, context: Any) -> None:
    images = {name: image for name, image in asset.images.items() if name != "albedo"}
    bare = replace(asset, manifest={**asset.manifest, "quantity": "irradiance"}, images=images)
    expected = methods.relight(bare, [LIGHTS["area"]])
    with Relighter(bare, context=context) as relighter:
        np.testing.assert_allclose(relighter.relight([LIGHTS["area"]]), expected, atol=TOLERANCE * expected.max())


def test_what_it_cannot_show_is_refused(asset: Asset, relighter: Relighter, context: Any, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="engines can read"):
        export(asset, "exr", tmp_path / "exr")
    with pytest.raises(InputError, match="named"):
        relighter.relight([NamedLight("Pendant")])
    with Relighter(replace(asset, scene=None), context=context) as bare, pytest.raises(InputError, match=r"scene\.glb"):
        bare.relight([LIGHTS["point"]])


def test_the_command_relights_by_shaders(asset: Asset, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    output = tmp_path / "out.exr"
    flags = ["--point", "0.8,0.7,1.1,1,0.5,0.2", "--falloff", "inverse-square", "--direct", "none", "--alpha", "none", "--renderer", "gl"]
    done = CliRunner().invoke(app, ["relight", str(tmp_path / "asset"), *flags, "-o", str(output)])
    assert done.exit_code == 0, done.output
    expected = methods.relight(asset, [LIGHTS["point"]])
    np.testing.assert_allclose(read_image(output, 3), expected, atol=TOLERANCE * expected.max())
