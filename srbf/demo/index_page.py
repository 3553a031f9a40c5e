"""The page that a demo opens with: a card with a picture, a sentence and a link for each scene, one file without network access."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any
from urllib.parse import quote

from numpy import ndarray

QUALITY = 82  # of a picture
REFRESH = 10  # seconds after which a page that grows is read again
STYLE = """
:root { color-scheme: dark; font: 16px/1.5 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 40px 24px 56px; max-width: 1160px; background: #0f1114; color: #d7dbe0; }
h1 { margin: 0; font-size: 27px; font-weight: 600; }
header p { margin: 6px 0 28px; max-width: 46em; color: #a3acb7; }
main { display: grid; gap: 24px; grid-template-columns: repeat(auto-fit, minmax(min(100%, 320px), 1fr)); }
article { display: flex; flex-direction: column; overflow: hidden; border: 1px solid #2c3037; border-radius: 12px; background: #17191d; }
.picture { position: relative; display: grid; place-items: center; aspect-ratio: 4 / 3; background: #1d2026; color: #8d96a1; }
.picture img { position: absolute; width: 100%; height: 100%; object-fit: cover; }
.text { display: flex; flex-direction: column; flex: 1; padding: 18px 20px 20px; }
h2 { margin: 0 0 6px; font-size: 19px; font-weight: 600; }
article p { margin: 0 0 12px; }
.note { margin-top: auto; padding-top: 4px; color: #8d96a1; font-size: 14px; }
.wrong { color: #ffb0a0; }
a { padding: 11px 16px; border-radius: 8px; background: #6ab7ff; color: #0b1016; }
a { font-weight: 600; text-align: center; text-decoration: none; }
a:hover, a:focus-visible { background: #9bcfff; }
@media (max-width: 500px) { body { padding: 24px 16px 32px; } h1 { font-size: 23px; } main { gap: 18px; } }
"""


@dataclass
class Card:
    """A scene on the page: `page` is the name of its file once it can be opened, with the state `opens`; `note` is what is known of it."""

    title: str
    sentence: str
    opens: dict[str, Any]
    page: str = ""
    picture: str = ""
    note: str = "Not begun yet."
    failed: bool = False
    is_done: bool = False

    def html(self) -> str:
        """An article."""
        shown = f'<img src="{self.picture}" alt="" />' if self.picture else "<span>no picture yet</span>"
        link = f'<a href="{escape(address(self.page, self.opens))}">Open</a>' if self.page else ""
        look = "note wrong" if self.failed else "note"
        note = escape(self.note).replace(" %", "&nbsp;%").replace(" dB", "&nbsp;dB")
        words = f'<h2>{escape(self.title)}</h2><p>{escape(self.sentence)}</p><p class="{look}">{note}</p>{link}'
        return f'<article><div class="picture">{shown}</div><div class="text">{words}</div></article>'


def address(page: str, opens: dict[str, Any]) -> str:
    """The address of a scene's page with the state that it opens with, as the page itself writes it."""
    return f"{page}#{quote(json.dumps(opens, separators=(',', ':')).replace(chr(34), chr(39)), safe=',:{}[]' + chr(39))}"


def data_uri(picture: ndarray) -> str:
    """sRGB bytes (H, W, 3) as an address that holds them."""
    from PIL import Image

    held = io.BytesIO()
    Image.fromarray(picture).save(held, "WEBP", quality=QUALITY, method=6)
    return f"data:image/webp;base64,{base64.b64encode(held.getvalue()).decode('ascii')}"


def index_page(cards: Sequence[Card], grows: bool) -> str:
    """HTML; one that `grows` is read again by itself."""
    refresh = f'<meta http-equiv="refresh" content="{REFRESH}" />\n' if grows else ""
    articles = "\n".join(card.html() for card in cards)
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8" />
<meta name="viewport" content="width=device-width, initial-scale=1" />
{refresh}<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; img-src data:" />
<title>srbf: relight these</title>
<link rel="icon" href="data:," />
<style>{STYLE}</style>
</head>
<body>
<header><h1>Relight these</h1>
<p>Baked on this machine. Each page is one file that opens from disk. Its numbers are of images that it was not made from.</p></header>
<main>
{articles}
</main>
</body>
</html>
"""
