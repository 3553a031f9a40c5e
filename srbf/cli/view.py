"""`srbf view`: an asset in the browser, its lights to be moved."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from srbf.cli.parameters import Blender, Force
from srbf.cli.terminal import note
from srbf.cli.values import Number
from srbf.errors import OutputExistsError
from srbf.io.files import write_text

if TYPE_CHECKING:
    from srbf.viewer.contents import Content
    from srbf.viewer.cycles import CyclesRenders

PORT = Number(whole=True, low=0, high=65535)


def view(
    folders: Annotated[
        list[Path],
        typer.Argument(
            metavar="FOLDER",
            help="An asset's folder, or several of one capture to switch between; and the capture, to compare with.",
            show_default=False,
        ),
    ],
    mesh: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A .glb whose lightmap UV set is shown, instead of the asset's texels.", show_default=False),
    ] = None,
    probes: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", help="An asset of probes under the same lights: a white sphere to move among them.", show_default=False
        ),
    ] = None,
    scene: Annotated[
        Path | None,
        typer.Option(
            metavar="SHOT.blend", help="Of a deep framebuffer: the page may render its lights by Cycles in this scene.", show_default=False
        ),
    ] = None,
    blender: Blender = None,
    profile: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="An IES file, or an image for spots to project, that lights on the page may have; may be given again.",
            show_default=False,
        ),
    ] = None,
    environment: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="An environment map that lights may have on the page, EXR or a picture; the first one shines; may be given again.",
            show_default=False,
        ),
    ] = None,
    port: Annotated[int, typer.Option(metavar="NUMBER", parser=PORT, help="On 127.0.0.1; 0: any that is free.")] = 0,
    save: Annotated[
        Path | None,
        typer.Option(
            metavar="PAGE",
            help="Serve nothing, and write NAME.html, one file that opens from the disk, or a folder for any static host.",
            show_default=False,
        ),
    ] = None,
    force: Force = False,
    browser: Annotated[bool, typer.Option(help="Open the page, or print its address only.")] = True,
) -> None:
    """Show an asset in the browser and move its lights; Ctrl-C ends it."""
    from srbf.cli.light_arguments import read_environment, read_profile
    from srbf.receiver_images import MANIFEST as CAPTURE_MANIFEST
    from srbf.viewer.contents import contents_of

    assets = [folder for folder in folders if not (folder / CAPTURE_MANIFEST).is_file()]
    captures = [folder for folder in folders if folder not in assets]
    if not assets or len(captures) > 1:
        raise typer.BadParameter(
            f"expected an asset or more, and at most one capture, found {len(assets)} and {len(captures)}; name them again"
        )
    capture = captures[0] if captures else None
    renders = None
    profiles = [read_profile(path) for path in profile or ()]
    if scene is None and blender is not None:
        raise typer.BadParameter("expected --scene with --blender, found none")
    if scene is not None:
        if save is not None:
            raise typer.BadParameter("expected --scene without --save, found both: what is saved has no server that renders")
        from srbf.asset import Asset
        from srbf.viewer.cycles import CyclesRenders

        renders = CyclesRenders(Asset.open(assets[0]), scene, blender, profiles)
    environments = [(path.name, read_environment(path)) for path in environment or ()]
    if capture is not None and save is not None and _is_file(save):
        raise typer.BadParameter("expected --save of a file without a capture, whose images it does not hold; name a folder")
    contents = contents_of(assets, capture, mesh, probes, renders, profiles, environments)
    if save is not None:
        _save(save, contents, force)
    else:
        serve(contents, port, browser, renders)


def serve(contents: dict[str, Content], port: int = 0, browser: bool = True, renders: CyclesRenders | None = None) -> None:
    """Hand out `contents` until Ctrl-C, and open the page; `renders`: what it may ask Cycles for."""
    from threading import Thread

    from srbf.viewer.server import ViewerServer

    server = ViewerServer(contents, port, renders)
    try:
        typer.echo(server.url)
        if browser:
            Thread(target=_open, args=(server.url,), daemon=True).start()  # a browser in the terminal would not come back
        server.serve_forever(poll_interval=0.1)
    except KeyboardInterrupt:
        return
    finally:
        server.server_close()


def _is_file(path: Path) -> bool:
    return path.suffix.lower() in (".html", ".htm")


def _save(path: Path, contents: dict[str, Content], force: bool) -> None:
    if _is_file(path):
        if path.exists() and not (force and path.is_file()):
            raise OutputExistsError(f"expected no {path} yet, found one; choose another name, or add --force")
        from srbf.viewer.single_file import single_file

        write_text(path, single_file(contents))
        size = path.stat().st_size
    else:
        from srbf.viewer.folder import write_page

        size = write_page(contents, path, force)
    note(f"wrote {path}, {size / (1 << 20):.1f} MiB")


def _open(url: str) -> None:
    import webbrowser

    if not webbrowser.open(url):
        note("no browser was found: open the address yourself")
