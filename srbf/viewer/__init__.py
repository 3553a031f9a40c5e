"""An asset in the browser: the built page, its configuration, and a local server for both."""
