"""A run as arrays, built in the same way from the loop's records and from a log's messages.

`Believed` holds what the figures of a run need of the belief about one body.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import nan, prod
from mmap import MAP_ANONYMOUS, MAP_PRIVATE, PAGESIZE, mmap
from sys import intern
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjnav.geometry.distances import nearest_tracks
from mjnav.messages import (
    PHASES,
    Array,
    Contact,
    Decision,
    RobotBelief,
    TickRecord,
    TickTiming,
    Track,
    Trajectory,
    WorldState,
    triangle,
)


@dataclass(frozen=True, slots=True)
class Believed:
    """The belief about the robot, n = 3, or about a person, n = 4."""

    mean: Array  # (n,)
    covariance: Array  # (n, n)
    ess: float  # effective sample size
    particles: float = nan  # how many; NaN where it is not known
    recovered: bool = False  # the filter was spread again
    unseen: float = 0.0  # [s] since the last detection that belongs to it

    @classmethod
    def of(cls, belief: RobotBelief | Track) -> "Believed":
        """That of a belief."""
        unseen = belief.unseen if isinstance(belief, Track) else 0.0
        return cls(belief.mean, belief.covariance, belief.ess, len(belief.weights), belief.recovered, unseen)


NO_ESTIMATE = Believed(np.full(3, np.nan), np.full((3, 3), np.nan), np.nan)
TRUTH = ("time", "robot_pose", "robot_twist", "people_position", "people_velocity")  # one row more than ticks


def nominal_control(decision: Decision) -> Array:
    """The nominal (v, omega), (2,); NaN where the method has none."""
    costs = decision.costs
    if costs is None:
        return np.full(2, np.nan)
    return np.array([costs.v[costs.nominal], costs.omega[costs.nominal]])


def track_number(name: str) -> int | None:
    """7 of "track7"; None for a name of another form."""
    found = re.fullmatch(r"track(\d{1,9})", name)
    return None if found is None else int(found[1])


class _Rows:
    """Rows of numbers in mapped memory, which grows by mapping more pages instead of copying.

    A heap would copy the rows and fragment; pages that are not written yet take no memory.
    """

    def __init__(self, shape: tuple[int, ...], kind: type[np.float64] | type[np.int64] = np.float64):
        self._shape, self._kind = shape, kind
        self._memory = mmap(-1, PAGESIZE, flags=MAP_PRIVATE | MAP_ANONYMOUS)
        self._count = 0

    def add(self, row: ArrayLike) -> None:
        data = np.asarray(row, self._kind).tobytes()
        if self._memory.tell() + len(data) > len(self._memory):
            self._memory.resize(2 * len(self._memory) + len(data))
        self._memory.write(data)
        self._count += 1

    def __deepcopy__(self, memo: dict[int, Any]) -> "_Rows":
        twin = _Rows(self._shape, self._kind)
        twin._memory.resize(len(self._memory))
        twin._memory.write(self._memory[: self._memory.tell()])
        twin._count = self._count
        return twin

    def finish(self) -> NDArray[Any]:
        """All rows, not copied; no more can be added."""
        numbers = np.frombuffer(self._memory, self._kind, self._count * prod(self._shape))
        return numbers.reshape(self._count, *self._shape)


class TrajectoryBuilder:
    """Collects ticks; `finish`, called once, takes the state in which the run ended and returns the arrays.

    A track belongs to the person of its name. Of those that carry no person's name, tick by tick, each person gets the
    one of the assignment with the least total distance: to judge them by, the robot never knows.
    """

    def __init__(self):
        self._rows: dict[str, _Rows] = {}
        self._places: dict[str, int] = {}  # of a track's person by its name
        self._status: list[str] = []
        self._contacts: list[Contact] = []
        self._timing = _Rows((len(PHASES) + 2,), np.int64)
        self._clipped = self._cautious = self._misses = 0  # ticks
        self._recoveries = 0

    def __len__(self) -> int:
        """The number of ticks so far."""
        return len(self._status)

    def add(self, record: TickRecord) -> None:
        """One tick."""
        decision, belief = record.decision, record.belief
        self.add_states(
            record.truth,
            estimate=None if belief is None else Believed.of(belief),
            tracks={track.name: Believed.of(track) for track in record.tracks},
            updated=record.reading is not None,
            command=record.command,
            decision=np.array([decision.v, decision.omega]),
            nominal=nominal_control(decision),
            status=str(decision.status),
            clipped=decision.clipped,
            cautious=bool(decision.caution),
        )

    def add_states(
        self,
        truth: WorldState,
        *,
        estimate: Believed | None,
        tracks: Mapping[str, Believed],
        updated: bool,
        command: Array,
        decision: Array,
        nominal: Array,
        status: str,
        clipped: bool,
        cautious: bool,
    ) -> None:
        """One tick by its parts: the truth, beliefs about the robot and by each track's name, (v, omega)s.

        Beliefs that no reading has `updated` are those of the tick before.
        """
        rows = self._rows or self._begin(len(truth.people_position))
        for name in TRUTH:
            rows[name].add(getattr(truth, name))
        robot = NO_ESTIMATE if estimate is None else estimate
        rows["estimate"].add(robot.mean)
        rows["estimate_triangle"].add(triangle(robot.covariance))
        rows["robot_ess"].add(robot.ess)
        rows["robot_particles"].add(robot.particles)
        means, ess = np.full((len(self._places), 4), np.nan), np.full(len(self._places), np.nan)
        covariances = np.full((len(self._places), 4, 4), np.nan)
        for person, track in self._by_person(tracks, truth).items():
            means[person], covariances[person], ess[person] = track.mean, track.covariance, track.ess
        rows["tracks"].add(means)
        rows["track_triangle"].add(triangle(covariances))
        rows["people_ess"].add(ess)
        if updated:
            self._recoveries += robot.recovered + sum(track.recovered for track in tracks.values())
        rows["command"].add(command)
        rows["decision"].add(decision)
        rows["nominal"].add(nominal)
        self._status.append(intern(status))
        self._contacts.extend(truth.contacts)
        self._clipped += clipped
        self._cautious += cautious

    def _by_person(self, tracks: Mapping[str, Believed], truth: WorldState) -> dict[int, Believed]:
        """Each person's track; those without a name become rows of `track_states`."""
        found: dict[int, Believed] = {}
        unnamed: list[Believed] = []
        for name, track in tracks.items():
            if (person := self._places.get(name)) is not None:
                found[person] = track
            elif (number := track_number(name)) is not None:
                unnamed.append(track)
                self._rows["track_states"].add((len(self), number, *track.mean, track.unseen))
        return found | nearest_tracks(truth.people_position, unnamed) if unnamed else found

    def add_timing(self, timing: TickTiming) -> None:
        """The timing of one tick; it may be missing for some."""
        self._timing.add((timing.tick, *timing.phases, timing.lateness))
        self._misses += timing.deadline_missed

    def finish(self, final: WorldState) -> Trajectory:
        """All ticks, and the state in which the run ended."""
        rows = self._rows or self._begin(len(final.people_position))
        for name in TRUTH:
            rows[name].add(getattr(final, name))
        return Trajectory(
            **{name: column.finish() for name, column in rows.items()},
            status=tuple(self._status),
            contacts=(*self._contacts, *final.contacts),
            timing=self._timing.finish(),
            deadline_misses=self._misses,
            clipped_ticks=self._clipped,
            cautious_ticks=self._cautious,
            recoveries=self._recoveries,
        )

    def _begin(self, num_people: int) -> dict[str, _Rows]:
        """The columns."""
        p = num_people
        shapes = {
            "time": (),
            "robot_pose": (3,),
            "robot_twist": (2,),
            "people_position": (p, 2),
            "people_velocity": (p, 2),
            "estimate": (3,),
            "estimate_triangle": (6,),
            "tracks": (p, 4),
            "track_triangle": (p, 10),
            **dict.fromkeys(("robot_ess", "robot_particles"), ()),
            "people_ess": (p,),
            **dict.fromkeys(("command", "decision", "nominal"), (2,)),
            "track_states": (7,),
        }
        self._places = {f"person{i}": i for i in range(p)}
        self._rows = {name: _Rows(shape) for name, shape in shapes.items()}
        return self._rows
