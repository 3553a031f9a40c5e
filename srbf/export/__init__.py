"""An asset in the form that an engine loads: one target a file."""
