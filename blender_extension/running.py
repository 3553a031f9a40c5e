# SPDX-License-Identifier: GPL-3.0-or-later
"""The one running job, and the timer that reads its output without blocking Blender."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from .process import Job, MissingHostError

PERIOD = 0.5  # seconds
_job: Job | None = None
_last = ""  # result of the last one
_then: Callable[[], None] | None = None  # what begins when the job has succeeded
_page: Job | None = None  # serves a page to the browser, beside other jobs


def job() -> Job | None:
    """The running job."""
    return _job if _job is not None and _job.running else None


def last() -> str:
    """One line on the last job's result; empty without one."""
    return _last


def start(new: Job, then: Callable[[], None] | None = None) -> None:
    """Follow a job from now on; `then` is called if it succeeds."""
    global _job, _last, _then
    _job, _last, _then = new, "", then
    if not bpy.app.timers.is_registered(listen):
        bpy.app.timers.register(listen, first_interval=PERIOD, persistent=True)


def listen() -> float | None:
    """Read the job's output and redraw the panel; the seconds to the next call, None once it has ended."""
    global _last, _then
    if _job is None:
        return None
    runs = _job.poll()
    if not runs:
        _last = _job.outcome()
        then, _then = _then, None
        if then is not None and _job.status == 0:
            try:
                then()
            except (OSError, MissingHostError) as error:
                _last = " ".join(str(error).split())
            runs = job() is not None
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()
    return PERIOD if runs else None


def open_page(new: Job) -> None:
    """Keep the server of a page until Blender ends, or another one is opened."""
    global _page
    close_page()
    _page = new


def page() -> Job | None:
    """The server of the page that is open, if it runs."""
    return _page if _page is not None and _page.poll() else None


def close_page() -> None:
    """Stop the server of the page."""
    global _page
    if _page is not None:
        _page.stop()
    _page = None


def end() -> None:
    """Stop the job and the page when Blender ends or the extension is disabled; a stopped bake can be resumed."""
    close_page()
    if bpy.app.timers.is_registered(listen):
        bpy.app.timers.unregister(listen)
    running = job()
    if running is not None:
        running.stop()
