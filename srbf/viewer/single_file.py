"""The page, its asset and its mesh in one HTML file that opens from disk without network access."""

from __future__ import annotations

import base64
import json
import re

from srbf.viewer.contents import Content, read

PAGE = ("", "index.html", "viewer.js", "viewer.css", "LICENSES.txt")
POLICY = "; ".join(
    ("default-src 'none'", "script-src 'unsafe-inline'", "style-src 'unsafe-inline'", "font-src data:", "img-src blob: data:")
    + ("connect-src blob: data:",)
)
FETCH = """{
  const held = JSON.parse(document.getElementById("held").textContent);
  const elsewhere = globalThis.fetch.bind(globalThis);
  const home = decodeURIComponent(new URL(".", document.baseURI).pathname);
  globalThis.fetch = (resource, options) => {
    const url = new URL(resource.url ?? resource, document.baseURI);
    const name = decodeURIComponent(url.pathname).slice(home.length);
    if (!/^(file|https?):$/.test(url.protocol) || !Object.hasOwn(held, name)) return elsewhere(resource, options);
    return Promise.resolve(new Response(Uint8Array.from(atob(held[name]), (c) => c.charCodeAt(0))));
  };
}"""


def single_file(contents: dict[str, Content]) -> str:
    """HTML of `contents_of` an asset, without the images of a capture."""
    kept = {name: content for name, content in contents.items() if name not in PAGE}
    held = {name: base64.b64encode(read(content)).decode("ascii") for name, content in kept.items()}
    names = json.dumps(held).replace("<", r"\u003c")  # no name ends the script
    script, style = (read(contents[name]).decode("utf-8") for name in ("viewer.js", "viewer.css"))
    parts = [
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}" />',
        f"<style>{style}</style>",
        f'<script type="application/json" id="held">{names}</script>',
        f"<script>{FETCH}</script>",
        f'<script type="text/plain" id="licenses">\n{read(contents["LICENSES.txt"]).decode("utf-8")}</script>',
        '<script type="module">' + re.sub(r"</(?=script)", r"<\\/", script, flags=re.IGNORECASE) + "</script>",
    ]
    page = read(contents["index.html"]).decode("utf-8")
    bare = re.sub(r'[ \t]*<(?:script[^>]*src="\./viewer\.js"[^>]*></script|link rel="stylesheet"[^>]*)>\n', "", page)
    return bare.replace("</head>", "\n".join(parts) + "\n</head>", 1)
