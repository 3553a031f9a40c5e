"""`srbf`, and `python -m srbf`."""

import sys


def main() -> None:
    """Run the command line; Ctrl-C while its libraries still load is one line, too."""
    try:
        from srbf.cli import app

        app()
    except KeyboardInterrupt:
        sys.exit("srbf: stopped before it began")


if __name__ == "__main__":
    main()
