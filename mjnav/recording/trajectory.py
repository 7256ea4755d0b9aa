"""A run as arrays, built in the same way from the loop's records and from a log's messages."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from itertools import chain
from typing import Any

import numpy as np

from mjnav.messages import PHASES, Array, Decision, TickRecord, TickTiming, Track, Trajectory, WorldState


def nominal_control(decision: Decision) -> Array:
    """The nominal (v, omega), (2,); NaN where the method has none."""
    costs = decision.costs
    if costs is None:
        return np.full(2, np.nan)
    return np.array([costs.v[costs.nominal], costs.omega[costs.nominal]])


def track_states(tracks: tuple[Track, ...]) -> dict[str, tuple[Array, Array]]:
    """Mean (4,) and covariance (4, 4) of each track by name."""
    return {track.name: (track.mean, track.covariance) for track in tracks}


def _joined(parts: list[Any]) -> Any:
    """Successive blocks' values of one field as one value: arrays, tuples or counts."""
    if isinstance(parts[0], np.ndarray):
        return np.concatenate(parts)
    return sum(parts) if isinstance(parts[0], int) else tuple(chain.from_iterable(parts))


class TrajectoryBuilder:
    """Collects ticks; `finish` takes the state in which the run ended and gives the arrays."""

    def __init__(self):
        self._blocks: list[Trajectory] = []  # all but the last have as many states as ticks
        self._clear()

    def _clear(self) -> None:
        self._truth: list[WorldState] = []
        self._estimate: list[tuple[Array, Array]] = []
        self._tracks: list[Mapping[str, tuple[Array, Array]]] = []
        self._controls: list[tuple[Array, Array, Array]] = []  # command, decision, nominal
        self._status: list[str] = []
        self._clipped = 0  # ticks
        self._timing: list[TickTiming] = []

    def __len__(self) -> int:
        """The number of ticks so far."""
        return sum(len(block.status) for block in self._blocks) + len(self._truth)

    def add(self, record: TickRecord) -> None:
        """One tick."""
        decision = record.decision
        self.add_states(
            record.truth,
            estimate=(record.belief.mean, record.belief.covariance),
            tracks=track_states(record.tracks),
            command=record.command,
            decision=np.array([decision.v, decision.omega]),
            nominal=nominal_control(decision),
            status=str(decision.status),
            clipped=decision.wish is not None,
        )

    def add_states(
        self,
        truth: WorldState,
        *,
        estimate: tuple[Array, Array],
        tracks: Mapping[str, tuple[Array, Array]],
        command: Array,
        decision: Array,
        nominal: Array,
        status: str,
        clipped: bool,
    ) -> None:
        """One tick by its parts: the truth, (mean, covariance) of the robot and by each track's name, (v, omega)s."""
        self._truth.append(truth)
        self._estimate.append(estimate)
        self._tracks.append(tracks)
        self._controls.append((command, decision, nominal))
        self._status.append(status)
        self._clipped += clipped

    def add_timing(self, timing: TickTiming) -> None:
        """The timing of one tick; it may be missing for some."""
        self._timing.append(timing)

    def compact(self) -> None:
        """Turns what was added into rows of arrays: a fifth of the memory, for runs of many thousand ticks.

        It takes a millisecond or so, which a loop in real time does not have.
        """
        if self._truth:
            self._blocks.append(self._block(len(self._truth[0].people_position), self._truth))
            self._clear()

    def finish(self, final: WorldState) -> Trajectory:
        """All ticks, and the state in which the run ended."""
        blocks = [*self._blocks, self._block(len(final.people_position), [*self._truth, final])]
        return Trajectory(
            **{field.name: _joined([getattr(b, field.name) for b in blocks]) for field in fields(Trajectory)}
        )

    def _block(self, num_people: int, states: Sequence[WorldState]) -> Trajectory:
        """What was added since the last block, with these states."""
        num_ticks, num_states = len(self._truth), len(states)
        tracks, covariances = self._people(num_people)
        controls = np.array(self._controls, float).reshape(num_ticks, 3, 2)
        timing = [(timing.tick, *timing.phases, timing.lateness) for timing in self._timing]
        return Trajectory(
            time=np.array([state.time for state in states]),
            robot_pose=np.array([state.robot_pose for state in states]),
            robot_twist=np.array([state.robot_twist for state in states]),
            people_position=np.array([state.people_position for state in states]).reshape(num_states, num_people, 2),
            people_velocity=np.array([state.people_velocity for state in states]).reshape(num_states, num_people, 2),
            estimate=np.array([mean for mean, _ in self._estimate], float).reshape(num_ticks, 3),
            estimate_covariance=np.array([cov for _, cov in self._estimate], float).reshape(num_ticks, 3, 3),
            tracks=tracks,
            track_covariance=covariances,
            command=controls[:, 0],
            decision=controls[:, 1],
            nominal=controls[:, 2],
            status=tuple(self._status),
            contacts=tuple(contact for state in states for contact in state.contacts),
            timing=np.array(timing, np.int64).reshape(-1, len(PHASES) + 2),
            deadline_misses=sum(timing.deadline_missed for timing in self._timing),
            clipped_ticks=self._clipped,
        )

    def _people(self, num_people: int) -> tuple[Array, Array]:
        """Means (T, P, 4) and covariances (T, P, 4, 4); a track belongs to the person whose name it bears."""
        place = {f"person{i}": i for i in range(num_people)}
        means = np.full((len(self._tracks), num_people, 4), np.nan)
        covariances = np.full((len(self._tracks), num_people, 4, 4), np.nan)
        for tick, tracks in enumerate(self._tracks):
            for name, (mean, covariance) in tracks.items():
                if (person := place.get(name)) is not None:
                    means[tick, person] = mean
                    covariances[tick, person] = covariance
        return means, covariances
