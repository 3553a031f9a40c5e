"""`python -m srbf`."""

from srbf.cli import app

if __name__ == "__main__":
    app()
