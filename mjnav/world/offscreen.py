"""OpenGL without a screen: EGL or OSMesa, whichever is there."""

import os
import subprocess
import sys
from functools import cache
from importlib import import_module
from typing import Any

from mjnav.errors import InputError

BACKENDS = ("egl", "osmesa")  # EGL first: it may have a graphics card behind it
PROBE_TIMEOUT = 60.0  # [s]

_ADVICE = "on Debian install libegl1 and libgl1-mesa-dri, or libosmesa6"


def open_context(width: int, height: int) -> Any:
    """An OpenGL context of MuJoCo's, to be used within its `as_current()` and freed; `width` and `height` in pixels.

    The variable MUJOCO_GL may name egl or osmesa; otherwise it is what works. Raises InputError where nothing does.
    """
    backend = _backend(os.environ.get("MUJOCO_GL", "").lower())
    try:
        context = import_module(f"mujoco.{backend}").GLContext(width, height)
        with context.as_current():  # shows that it works; left current, it would keep a window from opening
            pass
    except Exception as error:  # which class depends on what is missing: library, driver or display
        raise InputError(f"cannot draw without a screen ({backend}): {error}; {_ADVICE}") from error
    return context


@cache
def _backend(asked: str) -> str:
    """The backend asked for, or else the first one with which another process can draw.

    A backend that fails leaves libraries loaded on which the next one fails, so each is tried in another process.
    """
    if asked in BACKENDS:
        return asked
    for backend in BACKENDS:
        code = f"from mujoco.{backend} import GLContext as C; c = C(8, 8); c.make_current(); c.free()"
        command = [sys.executable, "-P", "-c", code]
        probe = subprocess.run(command, capture_output=True, timeout=PROBE_TIMEOUT, check=False)
        if probe.returncode == 0:
            return backend
    raise InputError(f"cannot draw without a screen: neither EGL nor OSMesa works; {_ADVICE}")
