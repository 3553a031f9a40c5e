"""The albedo of each material of a pixel, from the mean of all: beside it, by what is left, or of the image."""

from __future__ import annotations

import numpy as np

from srbf.visibility.material_albedo import MaterialAlbedo, nearest_pure

WHITE, RED, BLUE = (np.array(color, np.float32) for color in ((0.8, 0.8, 0.8), (0.7, 0.1, 0.05), (0.1, 0.2, 0.9)))
WALL, LEG, CORD = 0, 1, 2


def image(shares: dict[int, dict[int, float]], width: int = 8) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(albedo, pure, pixels, materials): a white wall, and pixels that show several materials by these shares of 100 samples."""
    colors = {WALL: WHITE, LEG: RED, CORD: BLUE}
    albedo = np.tile(WHITE, (width * width, 1))
    pure = np.full(width * width, WALL)
    pixels, materials = [], []
    for pixel, parts in shares.items():
        albedo[pixel] = sum(share * colors[material] for material, share in parts.items())
        pure[pixel] = -1
        for material, share in parts.items():
            materials += [material] * round(100 * share)
            pixels += [pixel] * round(100 * share)
    return albedo.reshape(width, width, 3), pure, np.array(pixels, np.int64), np.array(materials, np.int64)


def test_a_thin_material_has_what_is_left_of_the_mean() -> None:
    found = MaterialAlbedo.of(*image({27: {WALL: 0.7, LEG: 0.3}}))
    np.testing.assert_allclose(found.at(np.array([27, 27, 5]), np.array([LEG, WALL, WALL])), [RED, WHITE, WHITE], atol=1e-5)


def test_of_two_unknown_ones_the_image_tells() -> None:
    """The leg is alone with the wall elsewhere; where the cord is too, the leg's albedo is taken from there."""
    shares = {9: {WALL: 0.5, LEG: 0.5}, 54: {WALL: 0.5, LEG: 0.3, CORD: 0.2}}
    found = MaterialAlbedo.of(*image(shares))
    np.testing.assert_allclose(found.at(np.array([54, 9]), np.array([LEG, LEG])), [RED, RED], atol=1e-5)


def test_a_material_that_no_sample_met_is_that_beside_or_the_pixels_own() -> None:
    albedo, pure, pixels, materials = image({27: {WALL: 0.7, LEG: 0.3}})
    pure[60], albedo.reshape(-1, 3)[60] = LEG, RED
    found = MaterialAlbedo.of(albedo, pure, pixels, materials)
    np.testing.assert_allclose(found.at(np.array([59, 5, 5]), np.array([LEG, LEG, 7])), [RED, WHITE, WHITE], atol=1e-5)


def test_without_pixels_of_several_materials_each_has_its_own() -> None:
    found = MaterialAlbedo.of(*image({}))
    np.testing.assert_allclose(found.at(np.arange(64), np.zeros(64, np.int64)), np.tile(WHITE, (64, 1)))


def test_the_nearest_pixel_does_not_wrap_around_the_image() -> None:
    pure = np.zeros((4, 8), np.int64)
    pure[:, 7] = LEG
    assert nearest_pure(pure.ravel(), (4, 8), np.array([8, 13]), np.array([LEG, LEG])).tolist() == [-1, 15]
