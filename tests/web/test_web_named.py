"""Light mixing in every web engine: lights of the scene are dimmed, recolored and switched by name, and the pixels are their sum."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
from named_assets import NAMES, Mixed, light_mix, named_maps
from web_assets import ALBEDO, HALF_EXTENT

MADE = {
    "clusters": lambda: light_mix(clusters=7),
    "one cluster": lambda: light_mix(clusters=None, components=9, encoding="uint8"),
    "maps": named_maps,
}
ENGINES = {
    "three maps": ("three-material", {"material": "MeshLambertMaterial", "source": "maps"}),
    "three lightmap": ("three-material", {"material": "MeshLambertMaterial", "source": "lightmap"}),
    "nodes webgl": ("nodes-material", {"material": "MeshLambertMaterial", "source": "lightmap", "backend": "webgl"}),
    "nodes webgpu": ("nodes-material", {"material": "MeshLambertMaterial", "source": "lightmap", "backend": "webgpu"}),
    "babylon": ("babylon-material", {"rightHanded": True}),
    "playcanvas": ("playcanvas-material", {}),
}
# Desk lamp dimmed, the window recolored, the TV off; the others as designed. # words: ok
MIX = {"Desk lamp": (0.25, (1.0, 1.0, 1.0)), "Window": (2.0, (1.0, 0.9, 0.3)), "TV": (0.0, (1.0, 1.0, 1.0))}
COLORS = {name: tuple(intensity * c for c in color) for name, (intensity, color) in MIX.items()}


@pytest.fixture(scope="module")
def served(browser: Any) -> dict[str, tuple[Mixed, str]]:
    made = {kind: make() for kind, make in MADE.items()}
    return {kind: (asset, browser.place(asset.write)) for kind, asset in made.items()}


@pytest.mark.parametrize(
    ("engine", "kind"),
    [(engine, kind) for engine in ENGINES for kind in MADE if (engine, kind) != ("three maps", "clusters")],  # a lightmap only
)
def test_a_mix_is_the_sum_of_its_lights(browser: Any, served: dict[str, tuple[Mixed, str]], engine: str, kind: str) -> None:
    """At first as designed; then mixed by name."""
    run, options = ENGINES[engine]
    options = cast("dict[str, Any]", options)
    asset, url = served[kind]
    job = {"asset": url, "color": ALBEDO, "half": HALF_EXTENT, **options}
    mixed: list[tuple[list[Any], Any]] = [([], {}), ([[name, *values] for name, values in MIX.items()], COLORS)]
    for named, colors in mixed:
        shown = browser.picture(run, **job, named=named) * np.pi / ALBEDO
        assert (np.abs(shown - asset.picture(colors)) <= asset.tolerance(colors)).all(), colors


@pytest.mark.parametrize("engine", ["babylon", "playcanvas"])
def test_clusters_are_mixed_between_texels_by_their_light(browser: Any, served: dict[str, tuple[Mixed, str]], engine: str) -> None:
    """Filtered, a pixel in the middle of a texel is that texel, whatever its neighbors' clusters are."""
    run, options = ENGINES[engine]
    options = cast("dict[str, Any]", options)
    asset, url = served["clusters"]
    shown = browser.picture(run, asset=url, color=ALBEDO, half=HALF_EXTENT, filter="linear", **options) * np.pi / ALBEDO
    assert (np.abs(shown - asset.picture({})) <= asset.tolerance({}, 2e-4)).all()


def test_an_unknown_name_and_other_lights_are_refused_in_one_line(browser: Any, served: dict[str, tuple[Mixed, str]]) -> None:
    _, url = served["clusters"]
    job = {"asset": url, "color": ALBEDO, "half": HALF_EXTENT, "material": "MeshLambertMaterial"}
    error = browser.response("three-material", **job, named=[["Lamp", 1, [1, 1, 1]]])["error"]  # words: ok
    assert '"Desk lamp"' in error and 'found "Lamp"; was it renamed after the bake?' in error  # words: ok
    sun = browser.response(
        "three-material", **job, follow=[{"type": "DirectionalLight", "color": (1, 1, 1), "intensity": 1, "position": (1, 1, 1)}]
    )
    assert "expected lights of named for this asset, found a directional one" in sun["error"]


def test_damaged_tables_are_named(browser: Any) -> None:
    asset = light_mix(clusters=3)
    for change, expected in {
        "lights": "expected one light for each name",
        "light_values": "expected light_values",
        "cluster_index": "expected a cluster_index",
    }.items():
        manifest = {key: value for key, value in asset.manifest.items() if key != change}
        if change == "lights":
            manifest["lights"] = [{"name": NAMES[0]}] * len(NAMES)
        broken = Mixed(manifest, asset.files, asset.responses, asset.terms, asset.ambient)
        assert expected in browser.response("load", asset=browser.place(broken.write))["error"]
    short = {**asset.files, "light_values.exr": (asset.files["light_values.exr"][0][:, :-1], "half")}
    url = browser.place(Mixed(asset.manifest, short, asset.responses, asset.terms, asset.ambient).write)
    assert f"expected {len(NAMES)} x 21 RGB numbers in light_values.exr, found 4 x 21" in browser.response("load", asset=url)["error"]
