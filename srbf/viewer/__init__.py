"""An asset in the browser: the built page, what it is told of an asset, and the server that hands both to one machine."""
