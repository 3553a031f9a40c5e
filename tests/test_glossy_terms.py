"""Glossy receivers under a cubemap: images and radiance toward viewers against the BRDF itself, terms and classes, missing files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from made_cubemaps import HEIGHT, SIDE, TESTED, WIDTH, made

from srbf.brdf_factors import MOST_TERMS
from srbf.capture import Capture
from srbf.cubemap import Cubemap
from srbf.cubemap_capture import CubemapCapture
from srbf.cubemap_transport import BOUNCES_FILE, TESTED_FILE
from srbf.errors import ImageError, InputError, ManifestError
from srbf.glossy_terms import GlossyTerms, groups_of
from srbf.microfacets import albedo_terms, alpha_of, reflected
from srbf.receiver_gloss import MOST_CLASSES, FactoredGloss, ReceiverGloss, framed, viewer_side
from srbf.sphere import fibonacci, normalize

pytest.importorskip("embreex")

ROUGH = np.where(np.arange(WIDTH) < WIDTH // 2, 0.8, 1.0) * np.ones((HEIGHT, 1))
SLANTED = normalize(np.array([[0.5, -0.3, 0.6]]))[0]
WAYS = np.broadcast_to(SLANTED, (HEIGHT, WIDTH, 3))


@pytest.fixture
def capture(tmp_path: Path) -> CubemapCapture:
    found = made(tmp_path / "capture", quantity="radiance", roughness=ROUGH)
    assert isinstance(found, CubemapCapture)
    return found


def brdf_toward(viewer: np.ndarray, light: np.ndarray) -> np.ndarray:
    """(P, 3) f NoL by the lobes of views, whose color is their whole albedo toward the viewer."""
    count = WIDTH * HEIGHT
    alpha = alpha_of(ROUGH.ravel())
    metal = (np.arange(count) % WIDTH < WIDTH // 2)[:, None]
    along = np.where(metal, np.array([0.9, 0.6, 0.3]), 0.05)
    (_, above), (_, grazing) = (albedo_terms(np.full(count, cosine), alpha) for cosine in (1.0, viewer[2]))
    normal = (along - above[:, None]) / (1 - above[:, None])
    color = normal * (1 - grazing[:, None]) + grazing[:, None]
    up, one = np.broadcast_to([0.0, 0.0, 1.0], (count, 3)), np.ones(count)
    return reflected(up, np.broadcast_to(viewer, (count, 3)), np.broadcast_to(light, (count, 3)), color, alpha, one)


@pytest.mark.parametrize("place", [0, 1])
def test_radiance_toward_a_viewer_is_diffuse_reflection_and_the_lobe(capture: CubemapCapture, place: int) -> None:
    """Of lights that test, whose visibility and bounces the capture has."""
    index = capture.indices("holdout")[place]
    direction = np.array(TESTED[place])
    with np.load(capture.folder / TESTED_FILE) as stored:
        seen = np.unpackbits(stored["bits"], axis=1)[:, place]
        bounced = np.load(capture.folder / BOUNCES_FILE)["shapes"] @ stored["weights"][place]
    image = capture.geometry("albedo")
    assert image is not None
    albedo = image.reshape(-1, 3)[capture.receivers]
    expected = (seen[:, None] * direction[2] + bounced) * albedo / np.pi
    expected += seen[:, None] * brdf_toward(SLANTED, direction)[capture.receivers]
    found = capture.toward(index, WAYS).reshape(-1, 3)
    np.testing.assert_allclose(found[capture.receivers], expected, rtol=1e-4, atol=1e-6)
    assert 0 < seen.mean() < 1 and not np.delete(found, capture.receivers, axis=0).any()


def test_images_are_radiance_straight_up(capture: CubemapCapture) -> None:
    up = np.broadcast_to(np.array([0.0, 0.0, 1.0]), (HEIGHT, WIDTH, 3))
    for column in Cubemap(SIDE).texel_of(np.array([[0.3, 0.2, 1.0], [0.2, 0.9, 0.4], [0.1, 0.1, -1.0]])).tolist():
        np.testing.assert_allclose(capture.image(column), capture.toward(column, up), rtol=1e-4, atol=1e-6)
    texels = np.array([5, 200, WIDTH * HEIGHT - 1, 77])
    columns = [3, 290, 301]
    images = np.stack([capture.image(i).reshape(-1, 3)[texels] for i in columns], axis=1)
    np.testing.assert_allclose(capture.sample(columns, texels), images, rtol=1e-5, atol=1e-7)


def test_without_gloss_images_are_as_before(tmp_path: Path) -> None:
    plain, glossy = made(tmp_path / "plain", quantity="radiance"), made(tmp_path / "glossy", quantity="radiance", roughness=ROUGH)
    assert plain.gloss_terms is None and glossy.gloss_terms == 4 and isinstance(glossy, CubemapCapture)
    column = int(Cubemap(SIDE).texel_of(np.array([[0.3, 0.2, 1.0]]))[0])
    more = glossy.image(column) - plain.image(column)
    assert (more.reshape(-1, 3)[glossy.receivers] >= -1e-6).all() and more.max() > 0.05
    below = int(Cubemap(SIDE).texel_of(np.array([[0.1, 0.1, -1.0]]))[0])
    np.testing.assert_array_equal(glossy.image(below), plain.image(below))


@pytest.mark.parametrize(("terms", "most"), [(16, 0.03), (4, 0.2)])
def test_terms_and_their_viewers_are_the_radiance(capture: CubemapCapture, terms: int, most: float) -> None:
    gloss = capture.receiver_gloss
    factors = FactoredGloss.of(gloss, gloss.classes(), terms)
    split = GlossyTerms.of(capture, factors)
    assert len(split.lights) == 6 * SIDE**2 * groups_of(terms) and split.gloss_terms is None
    column = int(Cubemap(SIDE).texel_of(np.array([[0.3, 0.2, 1.0]]))[0])
    images = [split.image(column * split.groups + group).reshape(-1, 3)[capture.receivers] for group in range(split.groups)]
    parts = np.concatenate(images[1:], axis=1)[:, :terms]
    seen = factors.of_viewers(np.broadcast_to(SLANTED, gloss.normals.shape))
    found = images[0] + np.einsum("rk,rkc->rc", parts, seen)
    true = capture.toward(column, WAYS).reshape(-1, 3)[capture.receivers]
    diffuse = capture.received(column)[1]
    assert np.linalg.norm(found - true) < most * np.linalg.norm(true - diffuse)
    rows = split.sample([column * split.groups + 1], capture.receivers[:9])
    np.testing.assert_allclose(rows[:, 0], images[1][:9], rtol=1e-6)


@pytest.mark.parametrize("terms", [2, 64])
def test_gloss_shows_bounces_and_terms_their_mean_color(tmp_path: Path, terms: int) -> None:
    """Where no light shines directly: a direction from below. All terms together are the whole BRDF."""
    without, capture = (made(tmp_path / str(more), quantity="radiance", roughness=ROUGH, bounced_gloss=more) for more in (False, True))
    assert isinstance(without, CubemapCapture) and isinstance(capture, CubemapCapture)
    below = int(Cubemap(SIDE).texel_of(np.array([[0.1, 0.1, -1.0]]))[0])
    more = (capture.toward(below, WAYS) - without.toward(below, WAYS)).reshape(-1, 3)[capture.receivers]
    with np.load(capture.folder / BOUNCES_FILE) as stored:
        waves = np.einsum("krj,jc->krc", stored["harmonics"], stored["weights"][:, below])
    gloss = capture.receiver_gloss
    viewers = np.broadcast_to(SLANTED, gloss.normals.shape)
    np.testing.assert_allclose(more, np.einsum("krc,rkc->rc", waves, gloss.of_bounces(viewers)), rtol=1e-4, atol=1e-6)
    up = np.broadcast_to(np.array([0.0, 0.0, 1.0]), (HEIGHT, WIDTH, 3))
    np.testing.assert_allclose(capture.image(below), capture.toward(below, up), rtol=1e-4, atol=1e-6)
    factors = FactoredGloss.of(gloss, gloss.classes(), terms)
    split = GlossyTerms.of(capture, factors)
    images = [split.image(below * split.groups + group).reshape(-1, 3)[capture.receivers] for group in range(1, split.groups)]
    parts = np.concatenate(images, axis=1)[:, :terms]
    np.testing.assert_allclose(parts, np.einsum("krc,rnk->rn", waves / 3, factors.of_bounces(), optimize=True), rtol=1e-3, atol=1e-5)
    if terms == MOST_TERMS:
        gray = np.einsum("kr,rkc->rc", waves.mean(axis=2), gloss.of_bounces(viewers))
        found = np.einsum("rn,rnc->rc", parts, factors.of_viewers(viewers))
        assert np.linalg.norm(found - gray) < 0.02 * np.linalg.norm(gray)


def test_a_quarter_of_the_directions_has_the_same_images(capture: CubemapCapture) -> None:
    gloss = capture.receiver_gloss
    split = GlossyTerms.of(capture, FactoredGloss.of(gloss, gloss.classes(), 2))
    coarse = split.coarse()
    assert 4 * len(coarse.lights) == len(split.lights) and coarse.angles.mean() == pytest.approx(1)
    place = next(i for i, light in enumerate(split.lights) if light.file == coarse.lights[5].file)
    np.testing.assert_array_equal(coarse.image(5), split.image(place))


def test_what_an_asset_keeps_of_the_factors_gives_the_same(capture: CubemapCapture) -> None:
    gloss = capture.receiver_gloss
    classes = gloss.classes()
    factors = FactoredGloss.of(gloss, classes, 3)
    again = viewer_side(gloss, classes, [one.orders.tolist() for one in factors.factors], factors.table())
    viewers = np.broadcast_to(SLANTED, gloss.normals.shape)
    np.testing.assert_allclose(again.of_viewers(viewers), factors.of_viewers(viewers), rtol=1e-5, atol=1e-6)


def gloss_of(roughness: np.ndarray, strength: float = 0.5) -> ReceiverGloss:
    shape = (len(roughness), 3)
    lobe = np.stack([roughness, np.ones(len(roughness)), np.ones(len(roughness))], axis=1)
    return ReceiverGloss.of(np.full(shape, strength), lobe, np.broadcast_to([0.0, 0.0, 1.0], shape))


def test_classes_are_the_roughnesses_that_there_are() -> None:
    few = gloss_of(np.repeat([0.3, 0.7], [5, 3])).classes()
    assert [one[0] for one in few] == [0.3, 0.7]
    many = gloss_of(np.linspace(0.2, 0.9, 500)).classes()
    levels = np.array([one[0] for one in many])
    assert len(many) == MOST_CLASSES and np.diff(levels).max() < 0.06
    assert len(gloss_of(np.array([0.4, 0.6]), strength=0.0).classes()) == 1


def test_receivers_without_gloss_have_no_terms() -> None:
    lobe = np.array([[0.5, 1, 1], [0, 0, 0]], float)
    gloss = ReceiverGloss.of(np.full((2, 3), 0.4), lobe, np.tile([0.0, 0.0, 1.0], (2, 1)))
    factors = FactoredGloss.of(gloss, gloss.classes(), 4)
    lights = np.tile(SLANTED, (2, 1))
    assert factors.of_lights(np.arange(2), lights)[0].any() and not factors.of_lights(np.arange(2), lights)[1].any()
    assert not factors.of_viewers(lights)[1].any() and np.isfinite(factors.of_viewers(lights)).all()


def test_frames_are_orthonormal_and_turn_with_the_normal() -> None:
    normals = np.concatenate([fibonacci(200), [[0, 0, 1.0], [0, 0, -1.0]]])
    frames = framed(normals)
    np.testing.assert_allclose(frames @ frames.transpose(0, 2, 1), np.broadcast_to(np.eye(3), frames.shape), atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(frames), 1, atol=1e-9)
    np.testing.assert_allclose(frames[:, 2], normals)


def test_viewers_from_below_see_what_is_seen_from_the_horizon() -> None:
    gloss = gloss_of(np.array([0.8]))
    found = [gloss.reflected(np.array([0]), np.array([[0.6, 0, 0.8]]), np.array([way])) for way in ([0.6, 0, -0.8], [1.0, 0, 0])]
    np.testing.assert_allclose(found[0], found[1])
    assert np.isfinite(found[0]).all() and not gloss.reflected(np.array([0]), np.array([[0.6, 0, -0.8]]), np.array([[0.0, 0, 1]])).any()


def test_a_capture_without_gloss_has_no_terms(tmp_path: Path) -> None:
    plain = made(tmp_path / "plain", quantity="radiance")
    factors = FactoredGloss.of(gloss_of(np.array([0.5])), [(0.5, 0.5, 1.0)], 4)
    with pytest.raises(InputError, match="expected the gloss of receivers under a cubemap"):
        GlossyTerms.of(plain, factors)
    assert isinstance(plain, CubemapCapture)
    with pytest.raises(ManifestError, match="expected the channels glossy and lobe"):
        _ = plain.receiver_gloss


@pytest.mark.parametrize("damage", ["missing", "truncated", "another"])
def test_a_damaged_file_of_lights_that_test_is_named(capture: CubemapCapture, damage: str) -> None:
    path = capture.folder / TESTED_FILE
    if damage == "another":
        path.write_bytes((capture.folder / BOUNCES_FILE).read_bytes())
    else:
        path.write_bytes(path.read_bytes()[:100])
        if damage == "missing":
            path.unlink()
    found = Capture.open(capture.folder)
    assert isinstance(found, CubemapCapture)
    with pytest.raises(ImageError, match="expected the cubemap's visibility and bounces"):
        found.toward(found.indices("holdout")[0], WAYS)


@pytest.mark.parametrize("value", [0, 65, "4"])
def test_a_broken_number_of_terms_is_refused(capture: CubemapCapture, value: object) -> None:
    path = capture.folder / "capture.json"
    manifest = json.loads(path.read_text())
    manifest["cubemap"]["gloss"]["terms"] = value
    path.write_text(json.dumps(manifest))
    with pytest.raises(ManifestError):
        Capture.open(capture.folder)
