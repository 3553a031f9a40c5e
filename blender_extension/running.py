# SPDX-License-Identifier: GPL-3.0-or-later
"""The one running job, and the timer that reads its output without blocking Blender."""

from __future__ import annotations

import bpy

from .process import Job

PERIOD = 0.5  # seconds
_job: Job | None = None
_last = ""  # result of the last one


def job() -> Job | None:
    """The running job."""
    return _job if _job is not None and _job.running else None


def last() -> str:
    """One line on the last job's result; empty without one."""
    return _last


def start(new: Job) -> None:
    """Follow a job from now on."""
    global _job, _last
    _job, _last = new, ""
    if not bpy.app.timers.is_registered(listen):
        bpy.app.timers.register(listen, first_interval=PERIOD, persistent=True)


def listen() -> float | None:
    """Read the job's output and redraw the panel; the seconds to the next call, None once it has ended."""
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
    """Stop the job when Blender ends or the extension is disabled; a stopped bake can be resumed."""
    if bpy.app.timers.is_registered(listen):
        bpy.app.timers.unregister(listen)
    running = job()
    if running is not None:
        running.stop()
