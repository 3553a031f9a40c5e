"""Raw files of cameras, developed by LibRaw with fixed settings, so that the images of a set are comparable."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from srbf.errors import ImageError, MissingLibraryError
from srbf.importing.pictures.found import Found, Tags

DEVELOPED = "developed {} from raw by LibRaw: linear, white balance of daylight, no automatic brightness"
TURNED = "turned {} by their EXIF orientation"


def read_raw(path: Path) -> Found:
    """Linear Rec.709 of 16 bits, rotated. White balance and scale are the camera's and do not depend on the image.

    MissingLibraryError without rawpy; ImageError if LibRaw does not support the file.
    """
    try:
        import rawpy
    except ImportError as error:
        raise MissingLibraryError(
            f"{path} is a raw file, whose development needs rawpy: pip install 'srbf[raw]', or export JPEG, PNG or TIFF from it"
        ) from error
    try:
        with rawpy.imread(str(path)) as raw:
            notes = (DEVELOPED, TURNED) if raw.sizes.flip else (DEVELOPED,)
            pixels = raw.postprocess(
                gamma=(1, 1),
                no_auto_bright=True,
                adjust_maximum_thr=0,
                use_camera_wb=False,
                use_auto_wb=False,
                output_color=rawpy.ColorSpace.sRGB,
                output_bps=16,
            )
    except (rawpy.LibRawError, OSError, ValueError) as error:
        said = error.args[0] if error.args else error
        said = said.decode(errors="replace") if isinstance(said, bytes) else str(said)
        raise ImageError(f"cannot develop the raw file {path}: {said}; export JPEG, PNG or TIFF from it") from error
    pixels = pixels if pixels.ndim == 3 else pixels[:, :, None]
    return Found((pixels / np.float32(65535)).astype(np.float32), "rgb" if pixels.shape[2] == 3 else "gray", 16, Tags(gamma=1.0), notes)
