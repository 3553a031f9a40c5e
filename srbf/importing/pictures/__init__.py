"""Image files from other sources, read with their metadata: orientation applied, in linear Rec.709, the main image, part and layer.

`read_picture` is for photographs, renders by other programs, masks and environment maps. `srbf.io.image` reads files of the project.
"""

from srbf.importing.pictures.found import RAW_SUFFIXES
from srbf.importing.pictures.meaning import Transfer
from srbf.importing.pictures.reading import Picture, read_picture, said_once

__all__ = ["RAW_SUFFIXES", "Picture", "Transfer", "read_picture", "said_once"]
