"""The gallery: scenes that show what the method can do and what it cannot, baked, fitted, measured and drawn for docs/gallery.md."""
