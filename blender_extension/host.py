# SPDX-License-Identifier: GPL-3.0-or-later
"""Run as a script: `srbf` as a command that a stop reaches, however Blender was started and on whatever system."""

import signal

# A Blender begun in the background of a shell's script has Ctrl-C ignored, and its children inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGBREAK"):  # Windows' other Ctrl-C, the only one that a process can send to another there
    signal.signal(signal.SIGBREAK, lambda *_: signal.raise_signal(signal.SIGINT))

if __name__ == "__main__":
    from srbf.__main__ import main

    main()
