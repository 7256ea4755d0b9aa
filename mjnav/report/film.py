"""A run as a film: its states at and between ticks, in a file that browsers play."""

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import InputError, InvalidValue, missing_extra
from mjnav.geometry.angles import wrap
from mjnav.messages import Array, Trajectory, WorldState, number

CODEC = "libx264"
QUALITY = "23"  # of x264's scale from 0, lossless, to 51
_MAX_FPS = 120


@dataclass(frozen=True, slots=True)
class FilmTiming:
    """Which part of a run a film shows: from `start` to `end` [s], `speed` times as fast as they were."""

    start: float
    end: float
    fps: int = 25
    speed: float = 1.0

    def __post_init__(self):
        if not 0.0 <= self.start < self.end:
            raise InvalidValue("start", self.start, f"a time from 0 to before the end ({self.end:g} s)")
        if not isinstance(self.fps, int) or not 1 <= self.fps <= _MAX_FPS:
            raise InvalidValue("fps", self.fps, f"a whole number from 1 to {_MAX_FPS}")
        if not 0.01 <= number("speed", self.speed) <= 100.0:
            raise InvalidValue("speed", self.speed, "a number from 0.01 to 100")

    def times(self) -> Array:
        """The simulated time of each frame [s]; the last one is not after the end."""
        step = self.speed / self.fps
        count = int((self.end - self.start) / step + 1e-6) + 1
        return np.minimum(self.start + step * np.arange(count), self.end)


@dataclass(frozen=True, slots=True)
class FilmFrame:
    """What one frame shows."""

    state: WorldState
    trail: Array  # (n, 2) the way of the robot up to here
    tracks: Array  # (P, 4) believed x, y, vx, vy of people; NaN for who has no track


def frame_at(trajectory: Trajectory, time: float) -> FilmFrame:
    """A run at any time within it [s]: linear between two ticks, headings the shorter way round."""
    t = trajectory
    last = len(t.time) - 1
    before = min(max(int(np.searchsorted(t.time, time, side="right")) - 1, 0), last)
    after = min(before + 1, last)
    share = 0.0 if after == before else (time - t.time[before]) / (t.time[after] - t.time[before])

    def between(rows: Array, start: int = before, end: int = after) -> Array:
        return rows[start] + share * (rows[end] - rows[start])

    pose = between(t.robot_pose)
    turn = wrap(t.robot_pose[after, 2] - t.robot_pose[before, 2])
    pose[2] = wrap(t.robot_pose[before, 2] + share * turn)
    state = WorldState(
        time=time,
        robot_pose=pose,
        robot_twist=between(t.robot_twist),
        people_position=between(t.people_position),
        people_velocity=between(t.people_velocity),
    )
    num_ticks = len(t.tracks)  # the last state has no belief
    if num_ticks:
        tracks = between(t.tracks, min(before, num_ticks - 1), min(after, num_ticks - 1))
    else:
        tracks = np.full((len(state.people_position), 4), np.nan)
    return FilmFrame(state, np.vstack([t.robot_pose[: before + 1, :2], pose[:2]]), tracks)


def require_codec() -> None:
    """Raises InputError where films cannot be written here."""
    try:
        import av
    except ImportError:
        raise missing_extra("av", "video") from None
    if CODEC not in av.codecs_available:
        raise InputError(f"the installed av has no {CODEC}: pip install --force-reinstall av brings one that has")


def write_film(path: str | PathLike[str], frames: Iterable[NDArray[np.uint8]], fps: int) -> int:
    """Writes `frames` (height, width, 3), all of one size with even sides, as an MP4 file; returns how many there were.

    H.264 with the index in front: browsers play it while it comes. Raises OSError for what the disk refuses.
    """
    import av

    count = 0
    with av.open(str(path), "w", format="mp4", options={"movflags": "faststart"}) as film:
        stream = film.add_stream(CODEC, rate=Fraction(fps), options={"crf": QUALITY})
        stream.pix_fmt = "yuv420p"  # the only one that all browsers play
        for pixels in frames:
            if count == 0:
                stream.height, stream.width = pixels.shape[:2]
            film.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, format="rgb24")))
            count += 1
        film.mux(stream.encode())
    return count
