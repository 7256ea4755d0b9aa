"""A run as arrays, built in the same way from the loop's records and from a log's messages.

`Believed` holds what the figures of a run need of the belief about one body.
"""

import re
from array import array
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from math import nan
from sys import intern

import numpy as np
from numpy.typing import ArrayLike

from mjnav import messages
from mjnav.geometry.distances import nearest_tracks


@dataclass(frozen=True, slots=True)
class Believed:
    """The belief about the robot, n = 3, or about a person, n = 4."""

    mean: messages.Array  # (n,)
    covariance: messages.Array  # (n, n)
    ess: float  # effective sample size
    particles: float = nan  # how many; NaN where it is not known
    recovered: bool = False  # the filter was spread again
    unseen: float = 0.0  # [s] since the last detection that belongs to it

    @classmethod
    def of(cls, belief: messages.RobotBelief | messages.Track) -> "Believed":
        """That of a belief."""
        unseen = belief.unseen if isinstance(belief, messages.Track) else 0.0
        return cls(belief.mean, belief.covariance, belief.ess, len(belief.weights), belief.recovered, unseen)


NO_ESTIMATE = Believed(np.full(3, np.nan), np.full((3, 3), np.nan), np.nan)
TRUTH = ("time", "robot_pose", "robot_twist", "people_position", "people_velocity")  # one row more than ticks


def nominal_control(decision: messages.Decision) -> messages.Array:
    """The nominal (v, omega), (2,); NaN where the method has none."""
    costs = decision.costs
    if costs is None:
        return np.full(2, np.nan)
    return np.array([costs.v[costs.nominal], costs.omega[costs.nominal]])


def track_number(name: str) -> int | None:
    """7 of "track7"; None for a name of another form."""
    found = re.fullmatch(r"track(\d{1,9})", name)
    return None if found is None else int(found[1])


class TrajectoryBuilder:
    """Collects ticks; `finish`, called once, takes the state in which the run ended and returns the arrays.

    A track belongs to the person of its name. Of those that carry no person's name, tick by tick, each person gets the
    one of the assignment with the least total distance: to judge them by, the robot never knows.
    """

    def __init__(self):
        # The numbers of each column, one row after another.
        self._rows: dict[str, array[float]] = defaultdict(partial(array, "d"))
        self._num_people = 0
        self._places: dict[str, int] = {}  # of a track's person by its name
        self._status: list[str] = []
        self._contacts: list[messages.Contact] = []
        self._timing: array[int] = array("q")
        self._clipped = self._cautious = self._misses = 0  # ticks
        self._recoveries = 0

    def __len__(self) -> int:
        """The number of ticks so far."""
        return len(self._status)

    def add(self, record: messages.TickRecord) -> None:
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
        truth: messages.WorldState,
        *,
        estimate: Believed | None,
        tracks: Mapping[str, Believed],
        updated: bool,
        command: messages.Array,
        decision: messages.Array,
        nominal: messages.Array,
        status: str,
        clipped: bool,
        cautious: bool,
    ) -> None:
        """One tick by its parts: the truth, beliefs about the robot and by each track's name, (v, omega)s.

        Beliefs that no reading has `updated` are those of the tick before.
        """
        self._add_truth(truth)
        robot = NO_ESTIMATE if estimate is None else estimate
        means, ess = np.full((self._num_people, 4), np.nan), np.full(self._num_people, np.nan)
        covariances = np.full((self._num_people, 4, 4), np.nan)
        for person, track in self._by_person(tracks, truth).items():
            means[person], covariances[person], ess[person] = track.mean, track.covariance, track.ess
        self._add(
            estimate=robot.mean,
            estimate_triangle=messages.triangle(robot.covariance),
            robot_ess=robot.ess,
            robot_particles=robot.particles,
            tracks=means,
            track_triangle=messages.triangle(covariances),
            people_ess=ess,
            command=command,
            decision=decision,
            nominal=nominal,
        )
        if updated:
            self._recoveries += robot.recovered + sum(track.recovered for track in tracks.values())
        self._status.append(intern(status))
        self._contacts.extend(truth.contacts)
        self._clipped += clipped
        self._cautious += cautious

    def _by_person(self, tracks: Mapping[str, Believed], truth: messages.WorldState) -> dict[int, Believed]:
        """Each person's track; those without a name become rows of `track_states`."""
        found: dict[int, Believed] = {}
        unnamed: list[Believed] = []
        for name, track in tracks.items():
            if (person := self._places.get(name)) is not None:
                found[person] = track
            elif (number := track_number(name)) is not None:
                unnamed.append(track)
                self._add(track_states=(len(self), number, *track.mean, track.unseen))
        return found | nearest_tracks(truth.people_position, unnamed) if unnamed else found

    def add_timing(self, timing: messages.TickTiming) -> None:
        """The timing of one tick; it may be missing for some."""
        self._timing.extend((timing.tick, *timing.phases, timing.lateness))
        self._misses += timing.deadline_missed

    def finish(self, final: messages.WorldState) -> messages.Trajectory:
        """All ticks, and the state in which the run ended."""
        self._add_truth(final)
        p = self._num_people
        shapes = {
            **dict.fromkeys(("time", "robot_ess", "robot_particles"), ()),
            **dict.fromkeys(("robot_pose", "estimate"), (3,)),
            **dict.fromkeys(("robot_twist", "command", "decision", "nominal"), (2,)),
            **dict.fromkeys(("people_position", "people_velocity"), (p, 2)),
            "estimate_triangle": (6,),
            "tracks": (p, 4),
            "track_triangle": (p, 10),
            "people_ess": (p,),
        }
        ticks, told = len(self), "people_radius" in self._rows
        columns = {
            name: np.frombuffer(self._rows.get(name, b"")).reshape(ticks + (name in TRUTH), *shape)
            for name, shape in shapes.items()
        }
        return messages.Trajectory(
            **columns,
            track_states=np.frombuffer(self._rows.get("track_states", b"")).reshape(-1, 7),
            status=tuple(self._status),
            contacts=(*self._contacts, *final.contacts),
            timing=np.frombuffer(self._timing, np.int64).reshape(-1, len(messages.PHASES) + 2),
            deadline_misses=self._misses,
            clipped_ticks=self._clipped,
            cautious_ticks=self._cautious,
            recoveries=self._recoveries,
            people_radius=np.frombuffer(self._rows["people_radius"]).reshape(-1, p) if told else None,
        )

    def _add_truth(self, truth: messages.WorldState) -> None:
        if not self._rows:
            self._num_people = len(truth.people_position)
            self._places = {f"person{i}": i for i in range(self._num_people)}
        self._add(**{name: getattr(truth, name) for name in TRUTH})
        if truth.people_radius is not None:
            self._add(people_radius=truth.people_radius)

    def _add(self, **rows: ArrayLike) -> None:
        """A row of each of these columns."""
        for name, row in rows.items():
            self._rows[name].frombytes(np.asarray(row, float).tobytes())
