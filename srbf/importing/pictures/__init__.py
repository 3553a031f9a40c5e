"""Pictures as people have them, read with their meaning: turned, in linear Rec.709, of the image, part and layer that is meant.

`read_picture` is for photographs, others' renders, masks and environment maps. What the project wrote itself is read by `srbf.io.image`.
"""

from srbf.importing.pictures.found import RAW_SUFFIXES
from srbf.importing.pictures.meaning import Transfer
from srbf.importing.pictures.reading import Picture, read_picture, said_once

__all__ = ["RAW_SUFFIXES", "Picture", "Transfer", "read_picture", "said_once"]
