"""What a run leaves behind: its trajectory, its events, a hash of its states, and the log where there is one."""

import hashlib
from collections.abc import Callable

import numpy as np

from mjnav.loop.events import Events
from mjnav.loop.onboard.navigator import Beliefs, Navigator
from mjnav.loop.pacer import Start, Stopwatch
from mjnav.loop.result import RunSummary
from mjnav.messages import (
    Array,
    ConeDistribution,
    Decision,
    Event,
    Observation,
    Reading,
    TickRecord,
    TickTiming,
    Trajectory,
    WorldState,
)
from mjnav.recording.read.trajectory import TrajectoryBuilder
from mjnav.recording.write.writer import Recorder
from mjnav.scenarios.spec import Scenario
from mjnav.sealed import sealed


class RunRecord:
    """Collects what the ticks of one run saw and did.

    `recorder` writes the log, if any; `watch` is shown every tick; `cones` also computes the constraint's samples,
    which only a log and some watchers need.
    """

    def __init__(
        self, robot: Navigator, recorder: Recorder | None, *, watch: Callable[[TickRecord], None], cones: bool
    ):
        self._robot, self._recorder = robot, recorder
        self._watch, self._cones = watch, cones
        self._trajectory = TrajectoryBuilder()
        self._events = Events()
        self._hash = hashlib.sha256()

    def __len__(self) -> int:
        """The number of ticks."""
        return len(self._trajectory)

    def note(self, *events: Event) -> None:
        """Events that belong to the next tick, or to the end of the run where no tick follows."""
        self._events.note(*events)

    def add(
        self,
        k: int,
        truth: WorldState,
        readings: tuple[Reading, ...],
        beliefs: Beliefs,
        observation: Observation,
        decision: Decision,
        command: Array,
    ) -> None:
        """Everything that tick `k` saw and did."""
        self._hash.update(truth.robot_pose.tobytes() + beliefs.robot.mean.tobytes() + command.tobytes())
        record = TickRecord(
            tick=k,
            truth=truth,
            reading=readings[-1] if readings else None,
            readings_before=readings[:-1],
            belief=beliefs.robot,
            tracks=beliefs.people,
            observation=observation,
            decision=decision,
            command=command,
            cone=self._cone(observation, decision) if self._cones else None,
            events=self._events.of_tick(truth, beliefs if readings else None, decision),
        )
        self._trajectory.add(record)
        if self._recorder is not None:
            self._recorder.write(record)
        self._watch(record)

    def add_timing(self, k: int, watch: Stopwatch, start: Start) -> None:
        """How long the phases of tick `k` took."""
        timing = TickTiming(k, watch.phases, start.lateness, start.missed)
        self._trajectory.add_timing(timing)
        if self._recorder is not None:
            self._recorder.write_timing(timing)

    def finish(self, final: WorldState, state_hash: str) -> tuple[Trajectory, str]:
        """The trajectory, and the hash of all states, of which `state_hash` is the world's last."""
        self._hash.update(state_hash.encode())
        return self._trajectory.finish(final), self._hash.hexdigest()

    @property
    def log_dropped(self) -> int:
        """How many parts of ticks the log could not take in time."""
        return self._recorder.dropped if self._recorder else 0

    def end_log(self, final: WorldState, summary: RunSummary, replay: Scenario | None) -> None:
        """Writes the log's last state, its last events, the result and the scenario of a replay, if it has its own."""
        if self._recorder is not None:
            events = self._events.at_end(final, summary.figures.outcome, self.log_dropped)
            self._recorder.finish(final, summary.document(), events, replay)

    def _cone(self, observation: Observation, decision: Decision) -> ConeDistribution | None:
        found = self._robot.controller.closest_cone(observation, decision)
        if found is None:
            return None
        obstacle, samples, desired = found
        samples, desired = (sealed(np.asarray(values, float)) for values in (samples, desired))
        return ConeDistribution(self._robot.names[obstacle], samples, desired, float((samples <= 0.0).mean()))
