# SPDX-License-Identifier: GPL-3.0-or-later
"""The one job that runs, and the timer that listens to it without holding Blender up."""

from __future__ import annotations

import bpy

from .process import Job

PERIOD = 0.5  # seconds
_job: Job | None = None
_last = ""  # how the last one ended


def job() -> Job | None:
    """The running job."""
    return _job if _job is not None and _job.running else None


def last() -> str:
    """One line on how the last job ended; empty where there was none."""
    return _last


def start(new: Job) -> None:
    """Listen to a job from now on."""
    global _job, _last
    _job, _last = new, ""
    if not bpy.app.timers.is_registered(listen):
        bpy.app.timers.register(listen, first_interval=PERIOD, persistent=True)


def listen() -> float | None:
    """Read what the job says and have the panel drawn again; the seconds to the next call, None once it has ended."""
    global _last
    if _job is None:
        return None
    runs = _job.poll()
    if not runs:
        _last = _job.outcome()
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()
    return PERIOD if runs else None


def end() -> None:
    """Blender ends, or the extension goes: nobody could stop the job any more, and a stopped bake loses nothing."""
    if bpy.app.timers.is_registered(listen):
        bpy.app.timers.unregister(listen)
    running = job()
    if running is not None:
        running.stop()
