"""three.js' nodes, in a browser, on WebGPU and on WebGL2: the pixels of every method are numpy's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from made_assets import build_neural
from web_assets import FOLLOWED, HALF_EXTENT, LIGHTS, complete, on_a_plane, tolerance

from srbf.asset import Asset
from srbf.export import export
from srbf.methods import relight

BACKENDS = ("webgl", "webgpu")
METHODS = ("relighting-map", "eigen-map", "clustered-eigen-map", "neural-map")
ALBEDO = (0.8, 0.5, 0.3)


@pytest.fixture(scope="module")
def served(browser: Any, make_asset: Callable[..., Asset], make_planes: Callable[..., Asset]) -> dict[str, tuple[Asset, str]]:
    """(asset, URL) by method."""
    made = [
        make_asset(k=7, encoding="half", ambient=True),
        make_planes(components=9, encoding="uint8"),
        make_planes(components=5, clusters=7),
        build_neural(),
    ]
    ready = [complete(on_a_plane(asset)) for asset in made]
    return {asset.method: (asset, browser.serve(asset)) for asset in ready}


@pytest.mark.parametrize(
    ("method", "backend"),
    [(method, backend) for backend in BACKENDS for method in METHODS if (method, backend) != ("eigen-map", "webgl")],  # slow to compile
)
def test_the_lightmap_that_nodes_draw_is_numpys(browser: Any, served: dict, method: str, backend: str) -> None:
    asset, url = served[method]
    drawn = browser.lightmaps("nodes-lightmap", url, list(LIGHTS.values()), backend=backend)
    for picture, lights in zip(drawn, LIGHTS.values(), strict=True):
        assert (np.abs(picture - relight(asset, lights)) <= tolerance(asset, lights)).all(), lights


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("material", ["MeshStandardMaterial", "MeshLambertMaterial", "MeshBasicMaterial"])
def test_node_materials_show_the_asset(browser: Any, served: dict, material: str, backend: str) -> None:
    """Albedo E / pi; a standard material keeps a share for its highlights, everywhere the same here."""
    asset, url = served["relighting-map"]
    job = {"asset": url, "lights": LIGHTS["several"], "material": material, "color": ALBEDO, "half": HALF_EXTENT, "source": "maps"}
    shown = browser.picture("nodes-material", **job, backend=backend) * np.pi / ALBEDO
    expected, allowed = relight(asset, LIGHTS["several"]), tolerance(asset, LIGHTS["several"])
    if material == "MeshStandardMaterial":
        share = (shown / expected)[expected > 0.1]
        assert share.min() > 0.9 and share.max() < 1 and np.ptp(share) < 1e-4
    else:
        assert (np.abs(shown - expected) <= allowed).all()
        half = browser.picture("nodes-material", **job, backend=backend, target="half") * np.pi / ALBEDO
        assert (np.abs(half - expected) <= tolerance(asset, LIGHTS["several"], "half")).all()


@pytest.mark.parametrize("backend", BACKENDS)
def test_nodes_follow_three_s_lights_in_place_of_its_diffuse_light(browser: Any, served: dict, backend: str) -> None:
    asset, url = served["relighting-map"]
    followed, lights = FOLLOWED["several"]
    job = {"asset": url, "material": "MeshLambertMaterial", "color": ALBEDO, "half": HALF_EXTENT, "follow": followed, "backend": backend}
    for source in ("maps", "lightmap"):
        shown = browser.picture("nodes-material", **job, source=source) * np.pi / ALBEDO
        assert (np.abs(shown - relight(asset, lights)) <= tolerance(asset, lights)).all(), source


@pytest.mark.parametrize("backend", BACKENDS)
def test_radiance_replaces_what_a_node_material_shows(browser: Any, make_asset: Callable[..., Asset], backend: str) -> None:
    asset = complete(make_asset(k=5, encoding="half"), quantity="radiance", source={"receiver": {"kind": "view"}})
    asset.images["coverage"][:] = 1
    job = {"lights": LIGHTS["several"], "material": "MeshBasicMaterial", "color": ALBEDO, "half": HALF_EXTENT, "source": "maps"}
    shown = browser.picture("nodes-material", asset=browser.serve(asset), **job, backend=backend, apply={"uvOrigin": "bottom"})
    assert (np.abs(shown[::-1] - relight(asset, LIGHTS["several"])) <= tolerance(asset, LIGHTS["several"])).all()


@pytest.mark.parametrize("backend", BACKENDS)
def test_nodes_read_bc7(browser: Any, make_asset: Callable[..., Asset], backend: str) -> None:
    asset = complete(make_asset(k=4, encoding="half", height=12, width=20))
    url = browser.place(lambda folder: export(asset, "ktx2", folder))
    exported = Asset.open(browser.folder(url))
    drawn = browser.lightmaps("nodes-lightmap", url, [LIGHTS["several"]], backend=backend)[0]
    assert exported.encoding == "bc7"
    assert (np.abs(drawn - relight(exported, LIGHTS["several"])) <= tolerance(exported, LIGHTS["several"])).all()
