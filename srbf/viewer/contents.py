"""All content that the page may request, by name."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from srbf.asset import MANIFEST, Asset
from srbf.capture import Capture
from srbf.channels import GLOSS
from srbf.errors import InputError
from srbf.io import files
from srbf.io.image import float_exr
from srbf.light_domain import domain_of_asset
from srbf.light_profile import Profile
from srbf.lights import EnvironmentLight
from srbf.methods import method_of
from srbf.methods.environment_table import has_environment_table
from srbf.viewer import light_tables, page_manifest
from srbf.viewer.built_page import page_files
from srbf.viewer.cycles import PLACE, CyclesRenders
from srbf.viewer.measures import Measures
from srbf.viewer.references import References
from srbf.viewer.site import shown_mesh

CAPTURE = "capture/"
PROBES = "probes/"
UNDER_ENVIRONMENTS = ("directions", "pool")  # kinds of lights whose assets the page always shows under environments

Content = bytes | Path | Callable[[], bytes]


def read(content: Content) -> bytes:
    """The bytes of a file, or of content made on request."""
    if isinstance(content, Path):
        return content.read_bytes()
    return content if isinstance(content, bytes) else content()


def contents_of(
    folders: Sequence[Path],
    capture: Path | None = None,
    mesh: Path | None = None,
    probes: Path | None = None,
    renders: CyclesRenders | None = None,
    profiles: Sequence[Profile] = (),
    environments: Sequence[tuple[str, EnvironmentLight]] = (),
) -> dict[str, Content]:
    """All content that the page may request of the assets in `folders`; it shows the first one first, and a sphere lit by `probes`.

    `renders`: what the page may ask Cycles for. `profiles`: of files, which its lights may have beside those of the scene's own lights.
    `environments`: maps by the names of their files; the first one shines.

    InputError if they, or the capture, belong to different scenes, the probes to other lights, or where an asset takes no `profiles`
    or `environments`, or two of them have one name; also the errors of `Asset.open`, `Capture.open` and `page_files`.
    """
    page = page_files()
    assets = [Asset.open(folder) for folder in folders]
    for asset, folder in zip(assets, folders, strict=True):
        if not method_of(asset).on_page:
            raise InputError(f"expected an asset that the page shows, found {asset.method} in {folder}; `srbf relight` shows it")
        if profiles and not method_of(asset).takes_profiles:
            raise InputError(f"expected an asset of lights inside the scene for profiles, found {asset.method} in {folder}; leave them out")
        if environments and not (domain_of_asset(asset.manifest).kind in UNDER_ENVIRONMENTS or has_environment_table(asset)):
            raise InputError(
                "expected an asset of distant lights, a deep framebuffer or a room with windows for an environment, "
                f"found {asset.method} in {folder}; leave it out"
            )
    _check_siblings(assets, folders)
    references = None
    if capture is not None:
        references = References(Capture.open(capture))
        for asset in assets:
            references.check(asset)
    notes: list[str] = []
    compared = references if references is not None and references.compared else None
    if references is not None and compared is None:
        notes.append("the page compares directional and point lights with a capture: of this one it uses the spectrum alone")
    if renders is not None and renders.changed:
        notes.append(renders.changed)
    shown = shown_mesh(assets[0], mesh, notes)
    probed = None if probes is None else _probes_beside(assets[0], Asset.open(probes), probes)
    measures = Measures(assets, references.capture if references else None)
    contents: dict[str, Content] = {"": page["index.html"], **page}
    given_tables = {}
    for number, given in enumerate(profiles):
        if given.name in given_tables:
            raise InputError(f"expected profiles of different names, found two of {given.name}; rename the file")
        given_tables[given.name] = {"file": f"profile-{number}.exr", "projected": given.projected}
        contents[f"profile-{number}.exr"] = partial(light_tables.profile_table, given)
    maps: dict[str, str] = {}
    for number, (name, light) in enumerate(environments):
        if name in maps:
            raise InputError(f"expected environments of different names, found two of {name}; rename the file")
        maps[name] = f"environment-{number}.exr"
        contents[maps[name]] = partial(float_exr, light.image)
    told = []
    names = page_manifest.names(assets, folders)
    for i, (asset, folder, name) in enumerate(zip(assets, folders, names, strict=True)):
        place = "asset/" if i == 0 else f"asset-{i}/"
        contents |= _files(asset, folder, place)
        contents[f"spectrum-{i}.json"] = partial(measures.spectrum, i)
        errors = None
        if compared is not None:
            errors = f"{CAPTURE}errors-{i}.json"
            contents[errors] = partial(measures.errors, i)
        own_tables = {}
        for number, (profile, made) in enumerate(light_tables.own_profiles(asset).items()):
            if profile in given_tables:
                raise InputError(f"expected profiles of different names, found two of {profile}; rename the file")
            own_tables[profile] = {"file": f"profile-{i}-{number}.exr", "projected": False}
            contents[f"profile-{i}-{number}.exr"] = made
        own = page_manifest.described(asset, name, place, f"spectrum-{i}.json", errors)
        if set(GLOSS) <= asset.images.keys():
            contents[light_tables.LOBE_ALBEDO] = light_tables.lobe_albedo
            own["lobe_albedo"] = light_tables.LOBE_ALBEDO
        told.append({**own, "profiles": own_tables | given_tables})
    if shown is not None:
        contents[page_manifest.MESH] = shown
    if probed is not None and probes is not None:
        contents |= _files(probed, probes, PROBES)
    if compared is not None:
        contents[f"{CAPTURE}lights.json"] = json.dumps(compared.lights()).encode()
        for index in compared.compared:
            contents[f"{CAPTURE}{index}.exr"] = partial(compared.image, index)
    page_facts = page_manifest.facts(
        assets[0],
        told,
        shown is not None,
        page_manifest.title(folders),
        CAPTURE if compared else None,
        tuple(notes),
        PROBES if probed else None,
        None if renders is None else renders.facts(),
        maps,
    )
    if renders is not None:
        contents |= {f"{PLACE}/status.json": renders.status, f"{PLACE}/image.exr": renders.image}
    contents[page_manifest.NAME] = json.dumps(page_facts).encode()
    return contents


def _check_siblings(assets: Sequence[Asset], folders: Sequence[Path]) -> None:
    def kind(asset: Asset) -> str:
        lights = domain_of_asset(asset.manifest).kind
        named = f" of {len(asset.manifest['lights'])} lights" if "lights" in asset.manifest else ""
        return f"{asset.width} x {asset.height} {asset.receiver_kind} of {asset.quantity} under {lights}{named}"

    for asset, folder in zip(assets, folders, strict=True):
        if kind(asset) != kind(assets[0]):
            advice = "view them apart" if assets[0].probes is asset.probes else "name the one of probes by `probes`"
            raise InputError(
                f"expected assets of one capture, found {kind(assets[0])} in {folders[0]} and {kind(asset)} in {folder}; {advice}"
            )


def _probes_beside(asset: Asset, probes: Asset, folder: Path) -> Asset:
    """The probes, if a lightmap's lights shine on them, too."""
    if probes.probes is None:
        raise InputError(
            f"expected an asset of probes in {folder} for `probes`, found one of a {probes.receiver_kind}; bake --receiver probes"
        )
    if asset.receiver_kind == "view":
        raise InputError("expected a lightmap or vertices for `probes` to move a sphere among, found a view, which has no mesh")

    def lights(of: Asset) -> str:
        kind = domain_of_asset(of.manifest).kind
        names = sorted(light["name"] for light in of.manifest["lights"]) if kind == "named" else []
        return " ".join(["lights inside the scene" if kind in ("cloud", "surfels") else kind, *names])

    if lights(asset) != lights(probes):
        raise InputError(
            f"expected probes of the same lights, {lights(asset)}, found {lights(probes)} in {folder}; bake both with one light set"
        )
    return probes


def _files(asset: Asset, folder: Path, place: str) -> dict[str, Content]:
    manifest = folder / MANIFEST
    found: dict[str, Content] = {}
    for name in (MANIFEST, *asset.manifest.get("sha256", {}), *_named(asset)):
        path = files.inside(folder, name, manifest)
        if path.is_file():
            found[place + name] = path
    return found


def _named(asset: Asset) -> list[str]:
    """Files named in asset.json, since an asset may lack checksums."""
    entries = [entry["file"] for entry in asset.layers]
    tables = [asset.manifest[name]["file"] for name in asset.tables]
    scene = [asset.manifest["scene"]] if "scene" in asset.manifest else []
    probes = [asset.receiver[name] for name in ("places", "nearness")] if asset.probes is not None else []
    return [*entries, *tables, *scene, *probes, *(asset.manifest[name] for name in asset.images)]
