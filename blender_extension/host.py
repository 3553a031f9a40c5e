# SPDX-License-Identifier: GPL-3.0-or-later
"""Run as a script: `srbf` as a command, and Windows' CTRL_BREAK as the Ctrl-C that another process cannot send it there."""

import signal

if hasattr(signal, "SIGBREAK"):
    signal.signal(signal.SIGBREAK, lambda *_: signal.raise_signal(signal.SIGINT))

if __name__ == "__main__":
    from srbf.__main__ import main

    main()
