"""`srbf view`: an asset in the browser, its lights to be dragged."""

from __future__ import annotations

import webbrowser
from pathlib import Path
from threading import Thread
from typing import Annotated

import typer

from srbf.capture import MANIFEST as CAPTURE_MANIFEST
from srbf.cli.parameters import Force
from srbf.cli.terminal import note
from srbf.errors import InputError, OutputExistsError
from srbf.io.files import write_text
from srbf.viewer.contents import Content, contents_of
from srbf.viewer.server import ViewerServer
from srbf.viewer.single_file import single_file


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
        Path | None, typer.Option(help="A .glb whose lightmap UV set is shown, instead of the asset's texels.", show_default=False)
    ] = None,
    port: Annotated[int, typer.Option(help="On 127.0.0.1; 0: any that is free.", min=0, max=65535)] = 0,
    save: Annotated[
        Path | None, typer.Option(help="Write one HTML file that opens from the disk, and serve nothing.", show_default=False)
    ] = None,
    force: Force = False,
    browser: Annotated[bool, typer.Option(help="Open the page, or print its address only.")] = True,
) -> None:
    """Show an asset in the browser under lights that are dragged; Ctrl-C ends it."""
    assets = [folder for folder in folders if not (folder / CAPTURE_MANIFEST).is_file()]
    captures = [folder for folder in folders if folder not in assets]
    if not assets or len(captures) > 1:
        raise InputError(f"expected an asset or more, and at most one capture, found {len(assets)} and {len(captures)}; name them again")
    capture = captures[0] if captures else None
    if save is not None:
        _save(save, contents_of(assets, None, mesh), capture, force)
        return
    serve(contents_of(assets, capture, mesh), port, browser)


def serve(contents: dict[str, Content], port: int = 0, browser: bool = True) -> None:
    """Hand out `contents` until Ctrl-C, and open the page."""
    server = ViewerServer(contents, port)
    try:
        typer.echo(server.url)
        if browser:
            Thread(target=_open, args=(server.url,), daemon=True).start()  # a browser in the terminal would not come back
        server.serve_forever(poll_interval=0.1)
    except KeyboardInterrupt:
        return
    finally:
        server.server_close()


def _save(path: Path, contents: dict[str, Content], capture: Path | None, force: bool) -> None:
    if capture is not None:
        raise typer.BadParameter("expected --save without a capture: one file does not hold its images")
    if path.exists() and not (force and path.is_file()):
        raise OutputExistsError(f"expected no {path} yet, found one; choose another name, or add --force")
    write_text(path, single_file(contents))
    note(f"wrote {path}, {path.stat().st_size / (1 << 20):.1f} MiB")


def _open(url: str) -> None:
    if not webbrowser.open(url):
        note("no browser was found: open the address yourself")
