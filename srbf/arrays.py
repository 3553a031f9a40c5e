"""Array annotations with shapes in letters: P receivers, L lights, K basis functions, N directions, H W image, 3 color or axis.

The names are jaxtyping's. Without jaxtyping installed they are inert, so that `import srbf` asks for numpy and scipy alone;
the tests check them at run time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jaxtyping import Bool, Float, Float16, Float32, Float64, Int
else:
    try:
        from jaxtyping import Bool, Float, Float16, Float32, Float64, Int
    except ImportError:

        class _Unchecked:
            def __class_getitem__(cls, _shape: object) -> type:
                return Any

        Bool = Float = Float16 = Float32 = Float64 = Int = _Unchecked

__all__ = ["Bool", "Float", "Float16", "Float32", "Float64", "Int"]
