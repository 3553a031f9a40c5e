"""`python -m srbf.cli`."""

from srbf.cli import app

if __name__ == "__main__":
    app()
