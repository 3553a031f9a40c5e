"""A headless OpenGL 3.3 context, its limits, and programs compiled on it; nothing outside srbf.gl imports moderngl."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from srbf.errors import MissingLibraryError, ShaderError
from srbf.gl.includes import ShaderSource

if TYPE_CHECKING:
    import moderngl

REQUIRED = 330  # OpenGL 3.3 core
SOFTWARE = ("llvmpipe", "softpipe", "SwiftShader")  # renderers without a GPU
EGL_LIBRARIES: tuple[dict[str, str], ...] = ({}, {"libgl": "libGL.so.1", "libegl": "libEGL.so.1"})  # without and with -dev links


@dataclass(frozen=True)
class Limits:
    """Limits of a context: texels per side, layers per array, texture units, vec4 uniforms of a fragment shader; whether it is software."""

    texture_size: int
    array_layers: int
    texture_units: int
    fragment_vectors: int
    software: bool = False

    @staticmethod
    def of(context: moderngl.Context) -> Limits:
        """Ask the context."""
        info = context.info
        return Limits(
            texture_size=int(info["GL_MAX_TEXTURE_SIZE"]),
            array_layers=int(info["GL_MAX_ARRAY_TEXTURE_LAYERS"]),
            texture_units=int(info["GL_MAX_TEXTURE_IMAGE_UNITS"]),
            fragment_vectors=int(info["GL_MAX_FRAGMENT_UNIFORM_COMPONENTS"]) // 4,
            software=any(name in str(info["GL_RENDERER"]) for name in SOFTWARE),
        )


def create_context() -> moderngl.Context:
    """A context without a window: EGL on Linux, the system's own elsewhere. The caller releases it.

    Raises MissingLibraryError without moderngl, ShaderError where OpenGL 3.3 is unavailable.
    """
    library = _moderngl()
    attempts: list[dict[str, Any]] = [{}]
    if sys.platform.startswith("linux"):
        attempts = [{"backend": "egl", **names} for names in EGL_LIBRARIES]
    reasons = []
    for settings in attempts:
        try:
            context: moderngl.Context = library.create_context(standalone=True, require=REQUIRED, **settings)
            return context
        except Exception as error:  # noqa: BLE001  moderngl and its backends raise Exception itself, so nothing narrower catches them
            reasons.append(str(error).splitlines()[0] if str(error) else type(error).__name__)
    raise ShaderError(
        f"expected an OpenGL 3.3 context, found none ({'; '.join(dict.fromkeys(reasons))}); "
        "install a driver, or a software one (Debian: apt-get install libegl1 libgl1 libgl1-mesa-dri)"
    )


def compile_program(context: moderngl.Context, vertex: ShaderSource, fragment: ShaderSource) -> moderngl.Program:
    """A linked program; ShaderError with the driver's messages as file:line."""
    library = _moderngl()
    try:
        return context.program(vertex_shader=vertex.text, fragment_shader=fragment.text)
    except library.Error as error:
        log = str(error)
        source = vertex if "vertex_shader" in log else fragment
        lines = [line.strip() for line in source.locate(log).splitlines()]
        found = [line for line in lines if "error" in line.lower()] or [line for line in lines if line]
        raise ShaderError(f"expected {source.files[0]} to compile, found {'; '.join(found)}") from error


def _moderngl() -> Any:
    try:
        import moderngl
    except ImportError as error:
        raise MissingLibraryError("relighting on the GPU needs moderngl: pip install moderngl") from error
    return moderngl
