"""Array annotations with shapes in letters: P receivers, L lights, K basis functions, N directions, H W image, 3 color or axis.

The names are jaxtyping's. Unless it has been imported before, as the tests do to check them at run time, they are inert: `import srbf`
asks for numpy and scipy alone, and does not take the time to import it.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jaxtyping import Bool, Float, Float16, Float32, Float64, Int
else:
    if sys.modules.get("jaxtyping"):  # the tests import it first
        from jaxtyping import Bool, Float, Float16, Float32, Float64, Int
    else:

        class _Unchecked:
            def __class_getitem__(cls, _shape: object) -> type:
                return Any

        Bool = Float = Float16 = Float32 = Float64 = Int = _Unchecked

__all__ = ["Bool", "Float", "Float16", "Float32", "Float64", "Int"]
