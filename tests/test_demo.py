"""What the demo asks of a bake."""

from __future__ import annotations

import pytest

from srbf.demo import SCENES


@pytest.mark.parametrize("name", SCENES)
def test_what_is_published_is_finer(name: str) -> None:
    scene = SCENES[name]
    draft, fine = (scene.settings(400, quality) for quality in ("draft", "publish"))
    assert draft.sun_angle == 0
    assert fine.width * fine.height >= 4 * draft.width * draft.height
    assert fine.width * draft.height == draft.width * fine.height, "of the same shape"
    assert (draft.samples, fine.samples) == (2, 4)
    assert fine.lights == draft.lights == 400
    assert (fine.sun_angle > 0) == (scene.receiver.kind == "lightmap"), "as wide as the light spacing"
