"""No GPU, no library: one line that says what to do."""

from __future__ import annotations

import sys
from typing import Any

import pytest

from srbf.errors import MissingLibraryError, ShaderError
from srbf.gl.context import EGL_LIBRARIES, Limits, create_context
from srbf.relighting.relighter import relight


def test_without_moderngl_it_is_named(monkeypatch: Any, make_asset: Any) -> None:
    monkeypatch.setitem(sys.modules, "moderngl", None)
    with pytest.raises(MissingLibraryError, match="pip install moderngl"):
        relight(make_asset(), [])


def test_without_opengl_one_line_says_what_to_install(monkeypatch: Any, make_asset: Any) -> None:
    moderngl = pytest.importorskip("moderngl")
    tried = []

    def refuse(**settings: Any) -> None:
        tried.append(settings)
        raise Exception("(detect) libEGL.so: not loaded\nmore")  # what the backend raises

    monkeypatch.setattr(moderngl, "create_context", refuse)
    monkeypatch.setattr(sys, "platform", "linux")
    with pytest.raises(ShaderError, match=r"OpenGL 3\.3 .*libEGL\.so: not loaded.*libegl1") as caught:
        relight(make_asset(), [])
    assert "\n" not in str(caught.value)
    assert len(tried) == len(EGL_LIBRARIES)
    assert tried[-1]["libegl"] == "libEGL.so.1"


def test_other_systems_use_their_own_backend(monkeypatch: Any) -> None:
    moderngl = pytest.importorskip("moderngl")
    tried = []
    monkeypatch.setattr(moderngl, "create_context", lambda **settings: tried.append(settings) or "made")
    monkeypatch.setattr(sys, "platform", "darwin")
    assert create_context() == "made"
    assert "backend" not in tried[0]


def test_limits_are_what_opengl_3_3_promises_at_least(context: Any) -> None:
    limits = Limits.of(context)
    assert limits.texture_size >= 1024
    assert limits.array_layers >= 256
    assert limits.texture_units >= 16
    assert limits.fragment_vectors >= 256
