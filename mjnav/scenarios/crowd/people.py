"""The people of a scene that a recording's tracks become, as tables of a run file."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mjnav.config import below, settled
from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.scenarios import files
from mjnav.scenarios.crowd.reader import read_recording
from mjnav.scenarios.crowd.spec import Crowd
from mjnav.scenarios.crowd.spline import TrackSplines
from mjnav.scenarios.crowd.tracks import Placement, Track, tracks_of
from mjnav.scenarios.people import MAX_WALKING_SPEED, PERIOD
from mjnav.scenarios.ranges import MAX_BODIES

MARGIN = (
    5  # rows of a track before and after the window that its spline keeps: each next one bends it 0.27 times as much
)
DIGITS = 6  # of seconds and metres in a resolved scene
LEAST_STAY = 0.1  # [s]
MAX_ROWS = 200_000  # of all tracks: a run file may have 10 MB
MAX_JUMPS = 0.1  # of the rows: more, and the file is not read as it was meant
STANDING = 0.2  # [m/s] slower steps do not count for the speed of who reacts
NEAR = 0.5  # [m] who ends no further from their start reacts by standing there until they leave


def put_crowd(document: dict[str, Any], folder: Path | None) -> None:
    """Puts people in place of the table [crowd] of a run file, behind those that are there.

    The recording's path counts from `folder`, or else from the working folder; without a folder none is allowed. Raises
    InvalidValue.
    """
    if "crowd" not in document:
        return
    with below("crowd"):
        crowd = settled(Crowd, document.pop("crowd"))
        if folder is None:
            raise InvalidValue("file", crowd.file, "nothing; only a run file may name another file")
        made = people_of(crowd, files.found(crowd.file, folder))
    people = document.get("people", [])
    document["people"] = [*people, *made] if isinstance(people, list) else people


def placement_of(crowd: Crowd) -> Placement:
    """How the table lays its recording into the scene."""
    return Placement(crowd.scale, crowd.mirror, crowd.rotation, crowd.offset, crowd.crop)


def people_of(crowd: Crowd, path: Path | str) -> list[dict[str, Any]]:
    """The recording's people, in the order in which they come in, as tables of `people`. Raises InvalidValue."""
    try:
        recording = read_recording(path, crowd.columns or None)
    except InvalidValue as error:
        raise _told_of_the_file(crowd.file, error) from None
    cut = tracks_of(recording, crowd.frame_rate, placement_of(crowd), crowd.max_gap)
    end = max((track.rows[-1, 0] for track in cut.tracks), default=0.0)
    first, last = crowd.window or (0.0, float(end))
    tracks = in_window(cut.tracks, first, last)
    if not cut.tracks or cut.num_jumps > MAX_JUMPS * len(recording.frame):
        found = f"{len(cut.tracks)} tracks, {cut.num_jumps} jumps, {cut.num_gaps} gaps"
        allowed = (
            f"what gives people two rows or more within crop, and hardly any faster than {MAX_WALKING_SPEED:g} m/s"
        )
        if crowd.crop and not cut.num_jumps and not cut.num_gaps:
            raise InvalidValue("crop", crowd.crop, "two corners with people between them, in the scene's coordinates")
        raise InvalidValue("scale" if cut.num_jumps > cut.num_gaps else "frame_rate", found, allowed)
    if not tracks:
        allowed = f"a window in which somebody walks; the recording ends at {end:g} s"
        raise InvalidValue("window", f"0 people from {first:g} to {last:g} s", allowed)
    num_rows = sum(len(track.rows) for track in tracks)
    if len(tracks) > MAX_BODIES or num_rows > MAX_ROWS:
        allowed = f"a window, or a crop, with at most {MAX_BODIES} people and {MAX_ROWS} rows"
        raise InvalidValue("window", f"{len(tracks)} people with {num_rows} rows", allowed)
    make = _replayed if crowd.people == "replay" else _reacting
    common = {"radius": crowd.radius, "sees_robot": crowd.sees_robot, "temperament": crowd.temperament}
    given = {key: value for key, value in common.items() if value is not None}
    return [{**table, **given} for table in make(tracks, first, last)]


def _told_of_the_file(name: str, error: InvalidValue) -> InvalidValue:
    """What is wrong with a recording, or with one of its lines, as an error of the key `file`."""
    if not error.key:
        return InvalidValue("file", name, error.allowed)
    inner = InvalidValue(error.key, error.found, error.allowed)
    return InvalidValue("file", name, f"a recording that can be read ({inner})")


def in_window(tracks: Sequence[Track], first: float, last: float) -> list[Track]:
    """The tracks of people who are there for a moment of a window [s], by the time at which they come in."""
    there = [one for one in tracks if min(one.rows[-1, 0], last) - max(one.rows[0, 0], first) > LEAST_STAY]
    return sorted(there, key=lambda track: float(track.rows[0, 0]))


def _replayed(tracks: Sequence[Track], first: float, last: float) -> Iterator[dict[str, Any]]:
    for track in tracks:
        rows = _kept(track.rows, first, last).round(DIGITS)
        enters, leaves = _stay(rows, last - first)
        start = TrackSplines([rows]).positions(enters)[0]
        yield {
            "start": start.tolist(),
            "behaviour": "replay",
            **({"enters": enters} if enters else {}),
            "leaves": leaves,
            "track": rows.tolist(),
        }


def _stay(rows: Array, length: float) -> tuple[float, float]:
    """When somebody comes, at a decision of people's, and goes [s]; `rows` count from the window's beginning."""
    enters = PERIOD * np.ceil(max(rows[0, 0], 0.0) / PERIOD - 1e-4)
    return round(float(enters), DIGITS), round(float(min(rows[-1, 0], length)), DIGITS)


def _kept(rows: Array, first: float, last: float) -> Array:
    """The rows of a track in a window [s], counted from its beginning, with MARGIN rows on both sides."""
    low = max(int(np.searchsorted(rows[:, 0], first)) - MARGIN, 0)
    high = int(np.searchsorted(rows[:, 0], last, side="right")) + MARGIN
    kept = rows[low:high].copy()
    kept[:, 0] -= first
    return kept


def _reacting(tracks: Sequence[Track], first: float, last: float) -> Iterator[dict[str, Any]]:
    """Start, end and speed of the part within the window; who stands stands until they leave."""
    for track in tracks:
        rows = track.rows.copy()
        rows[:, 0] -= first
        enters, leaves = _stay(rows, last - first)
        start, end = TrackSplines([rows]).positions(enters)[0].round(DIGITS), rows[-1, 1:].round(DIGITS)
        table = {
            "start": start.tolist(),
            "behaviour": "social_force",
            **({"enters": enters} if enters else {}),
            "waypoints": [end.tolist()],
        }
        if np.hypot(*(end - start)) <= NEAR:
            yield {**table, "waypoints": [start.tolist()], "at_end": "stay", "leaves": leaves}
        else:
            yield {**table, "speed": round(_walking_speed(track), DIGITS), "at_end": "leave"}


def _walking_speed(track: Track) -> float:
    """Way over time [m/s] of the steps in which the person walked; of all steps where they never did."""
    duration, speeds = np.diff(track.rows[:, 0]), track.speeds
    walked = speeds > STANDING if (speeds > STANDING).any() else np.ones(len(speeds), bool)
    return float((speeds * duration)[walked].sum() / duration[walked].sum())
