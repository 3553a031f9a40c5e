# SPDX-License-Identifier: GPL-3.0-or-later
"""Run as a script: `srbf` as a command that Stop can interrupt, however Blender was started and on every system."""

import signal

# Blender started in the background of a shell script ignores Ctrl-C, and its child processes inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGBREAK"):  # on Windows the only interrupt that one process can send to another
    signal.signal(signal.SIGBREAK, lambda *_: signal.raise_signal(signal.SIGINT))

if __name__ == "__main__":
    from srbf.__main__ import main

    main()
