"""The page as a folder for any static host: its assets, its mesh, and the images of a capture."""

from __future__ import annotations

from pathlib import Path

from srbf.io import files
from srbf.viewer import page_manifest
from srbf.viewer.contents import Content, read


def write_page(contents: dict[str, Content], folder: Path, force: bool = False) -> int:
    """Write `contents_of` assets to `folder`, atomically; how many bytes.

    OutputExistsError where it exists and `force` is not set, or where it holds something else.
    """
    with files.atomic_folder(folder, force, page_manifest.NAME) as temporary:
        for name, content in contents.items():
            if name:  # without one it is index.html
                files.make_folder((temporary / name).parent)
                (temporary / name).write_bytes(read(content))
        told = temporary / page_manifest.NAME
        sums = files.checksums(temporary, page_manifest.NAME)
        files.write_json(told, {**files.read_json(told), "sha256": sums})
        return sum((temporary / name).stat().st_size for name in sums)
