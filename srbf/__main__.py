"""`srbf`, and `python -m srbf`."""

from __future__ import annotations

import signal
import sys
from types import FrameType


def main() -> None:
    """Run the command line; Ctrl-C while its libraries still load is one line, too.

    A compiled library that Ctrl-C meets while it loads says ImportError, so the signal itself is remembered.
    """
    pressed = False

    def on_interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        pressed = True
        signal.default_int_handler(number, frame)

    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, on_interrupt)
    try:
        from srbf.cli import app

        app()
    except KeyboardInterrupt:
        sys.exit("srbf: stopped before it began")
    except ImportError:
        if not pressed:
            raise
        sys.exit("srbf: stopped while its libraries loaded; the same command resumes a bake, other outputs were not written")


if __name__ == "__main__":
    main()
