"""Where in the user's own code something happened."""

import sysconfig
from collections.abc import Iterable
from pathlib import Path
from traceback import FrameSummary


def location(frames: Iterable[FrameSummary], *, users_only: bool = False) -> str | None:
    """ "file:line, in function" of a stack, outermost frame first.

    That is the innermost frame of the user's own code, or else of mjnav's unless `users_only`: not that of a library
    below it.
    """
    frames = [frame for frame in frames if Path(frame.filename).is_file()]
    package = Path(__file__).parents[2]
    libraries = [Path(sysconfig.get_path(name)) for name in ("stdlib", "purelib", "platlib")]
    ours = [frame for frame in frames if Path(frame.filename).is_relative_to(package)]
    users = [frame for frame in frames if not any(map(Path(frame.filename).is_relative_to, (package, *libraries)))]
    for found in (users,) if users_only else (users, ours, frames):
        if found:
            return f"{found[-1].filename}:{found[-1].lineno}, in {found[-1].name}"
    return None
