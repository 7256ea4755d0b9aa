"""A recording read and measured, and the run file that makes a scene of a part of it."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mjnav.config import read
from mjnav.errors import InvalidValue
from mjnav.printable import printable
from mjnav.scenarios.crowd.frame_rate import RateGuess, guess_frame_rate
from mjnav.scenarios.crowd.people import in_window, placement_of
from mjnav.scenarios.crowd.reader import Recording, read_recording
from mjnav.scenarios.crowd.robot_way import robot_way
from mjnav.scenarios.crowd.spec import Crowd
from mjnav.scenarios.crowd.survey import Survey, survey
from mjnav.scenarios.crowd.tracks import Track, Tracks, tracks_of
from mjnav.scenarios.toml import toml_text

GIVEN = "given"
MAX_WINDOWS = 50_000  # more than a run's longest time has of the usual length


@dataclass(frozen=True, slots=True, eq=False)
class Imported:
    """A recording as a table [crowd] reads it."""

    crowd: Crowd
    recording: Recording
    rate: RateGuess
    step: float  # [frames] the usual one
    tracks: Tracks
    survey: Survey


def import_crowd(path: str | os.PathLike[str], table: Mapping[str, Any], length: float) -> Imported:
    """The recording in a file as the keys of [crowd] in `table` read it; the frame rate is guessed where it is missing.

    The survey has windows of `length` [s]. Raises InvalidValue, of a key of `table` or with the file.
    """
    given = read(Crowd, {"frame_rate": 1.0, **table, "file": os.fspath(path)})  # checks what is there
    recording = read_recording(os.fspath(path), given.columns or None)
    if "frame_rate" in table:
        rate = RateGuess(given.frame_rate, GIVEN, True)
    else:
        guess = guess_frame_rate(recording, given.scale)
        if guess is None:
            raise _nobody(path, recording, "in two rows or more")
        rate = guess
    crowd = read(Crowd, {**table, "file": os.fspath(path), "frame_rate": rate.frame_rate})
    tracks = tracks_of(recording, crowd.frame_rate, placement_of(crowd), crowd.max_gap)
    if not tracks.tracks:
        cuts = f"{tracks.num_jumps} jumps and {tracks.num_gaps} gaps cut them"
        how = f"{cuts} at a frame rate of {rate.frame_rate:g} Hz and a scale of {crowd.scale:g}"
        raise _nobody(path, recording, f"in two rows or more within the crop; {how}")
    duration = max(float(track.rows[-1, 0]) for track in tracks.tracks)
    if duration > MAX_WINDOWS * length:
        allowed = f"at least {duration / MAX_WINDOWS:.3g} s: at most {MAX_WINDOWS} windows of the {duration:.3g} s"
        raise InvalidValue("duration", length, allowed)
    step = recording.usual_step
    return Imported(crowd, recording, rate, step, tracks, survey(tracks.tracks, step / rate.frame_rate, length))


def _nobody(path: str | os.PathLike[str], recording: Recording, what: str) -> InvalidValue:
    found = f"{len(recording.frame)} rows of {len(recording.labels)} people, {recording.num_repeated} repeated"
    return InvalidValue("", found, f"people {what}", file=os.fspath(path))


def choose_window(tracks: Sequence[Track], length: float, people: int | None) -> tuple[float, float]:
    """The first part of `length` [s], in whole seconds, in which the number of people is nearest to `people`.

    Without a number, the one with most people. A shorter recording is taken whole.
    """
    enters = np.array([track.rows[0, 0] for track in tracks])
    leaves = np.array([track.rows[-1, 0] for track in tracks])
    end = float(leaves.max())
    if end <= length:
        return 0.0, end
    starts = np.arange(0.0, np.floor(end - length) + 1.0)
    entered = np.searchsorted(np.sort(enters), starts + length)
    counts = entered - np.searchsorted(np.sort(leaves), starts, side="right")
    start = float(starts[np.argmax(counts) if people is None else np.argmin(np.abs(counts - people))])
    return start, start + length


def scene_tables(found: Imported, window: tuple[float, float], name: str, folder: Path) -> dict[str, Any]:
    """The tables of a run file in `folder`: the people of a window [s], and a robot that crosses their area."""
    people = in_window(found.tracks.tracks, *window)
    if not people:
        end = max(track.rows[-1, 0] for track in found.tracks.tracks)
        raise InvalidValue("window", window, f"a window in which somebody walks; the recording ends at {end:g} s")
    way = robot_way(people, *window)
    file = found.crowd.file
    if not os.path.isabs(file):
        file = os.path.relpath(file, folder)
    return {
        "schema": 1,
        "name": name,
        "description": f"{printable(Path(file).name)}, {window[0]:g} to {window[1]:g} s: {len(people)} people.",
        "time_limit": round(window[1] - window[0], 3),
        "robot": {"start": list(way.start), "goal": list(way.goal)},
        "crowd": {"file": file, "frame_rate": found.crowd.frame_rate, "window": list(window)},
    }


def scene_text(tables: Mapping[str, Any], found: Imported) -> str:
    """The run file, which says first where it comes from."""
    rate = f"{found.rate.frame_rate:g} frames a second: {found.rate.basis}"
    return f"# Made by `mjnav import crowd`. {rate}.\n{toml_text(dict(tables))}"
