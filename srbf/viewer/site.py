"""`web`: a folder for any static host: the viewer's page, the asset and its mesh."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

from srbf.asset import MANIFEST, Asset
from srbf.errors import InputError
from srbf.export import exr, ktx2, png
from srbf.export.engine_folder import below
from srbf.export.gltf import model
from srbf.export.settings import PLAIN, Settings, Target, Written
from srbf.io import files
from srbf.viewer import page_manifest
from srbf.viewer.built_page import page_files
from srbf.viewer.measures import Measures

DATA = "data"
FORMS: dict[str, Target] = {"half": exr.write, "float": exr.write, "uint8": png.write, "bc7": ktx2.write, "bc1": ktx2.write}


def write(asset: Asset, folder: Path, settings: Settings = PLAIN) -> Written:
    """Fill an empty folder: `index.html` with its script and style, `viewer.json`, `spectrum.json`, `asset.json` with its images in
    `data/`, and `mesh.glb` of a lightmap: `settings.mesh`, or rebuilt from its texels.

    MissingLibraryError without the built page; InputError on a mesh without a UV set.
    """
    page = page_files()
    files.make_folder(folder / DATA)
    FORMS[settings.encoding or "half"](asset, folder / DATA, settings)
    files.write_json(folder / MANIFEST, below(DATA, files.read_json(folder / DATA / MANIFEST)))
    (folder / DATA / MANIFEST).unlink()
    notes: list[str] = []
    mesh = shown_mesh(asset, settings.mesh, notes)
    if mesh is not None:
        (folder / page_manifest.MESH).write_bytes(mesh)
    for name, path in page.items():
        shutil.copyfile(path, folder / name)
    written = Asset.open(folder)
    (folder / page_manifest.SPECTRUM).write_bytes(Measures([written]).spectrum(0))
    own = page_manifest.described(written, page_manifest.names([written], [folder])[0], "./", page_manifest.SPECTRUM)
    told = page_manifest.facts(written, [own], mesh is not None, page_manifest.receiver_name(asset), notes=tuple(notes))
    files.write_text(folder / page_manifest.NAME, json.dumps(told) + "\n")
    return Written(("upload the folder to any host; a browser opens it from there, not from the disk", *notes))


def shown_mesh(asset: Asset, mesh: Path | None, notes: list[str]) -> bytes | None:
    """The mesh of a lightmap; None for a view, and, with a note, if no mesh is available."""
    if mesh is None and asset.receiver_kind == "view":
        return None
    try:
        return model(asset, mesh)
    except InputError as error:
        if mesh is not None:
            raise
        notes.append(f"no mesh: {error}")
        return None
