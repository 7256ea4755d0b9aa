"""What a run leaves behind: its trajectory, its events, a hash of its states, and the log where there is one."""

import hashlib
from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np

from mjnav import messages
from mjnav.geometry.angles import mean_position
from mjnav.log.read.trajectory import TrajectoryBuilder
from mjnav.log.write.writer import Recorder
from mjnav.loop.events import Events
from mjnav.loop.pacer import Start, Stopwatch
from mjnav.loop.result import RunSummary
from mjnav.robot.navigator import Navigator
from mjnav.scene.spec import Scenario
from mjnav.sealed import sealed


class RunRecord:
    """Collects what the ticks of one run saw and did.

    `recorder` writes the log, if any; `watch` is shown every tick; `cones` also computes the constraint's samples,
    which only a log and some watchers need; `events` makes the events of the run.
    """

    def __init__(
        self,
        robot: Navigator,
        recorder: Recorder | None,
        *,
        watch: Callable[[messages.TickRecord], None],
        cones: bool,
        events: Events,
    ):
        self._robot, self._recorder = robot, recorder
        self._watch, self._cones = watch, cones
        self._trajectory = TrajectoryBuilder()
        self._events = events
        self._hash = hashlib.sha256()

    def __deepcopy__(self, memo: dict[int, Any]) -> "RunRecord":
        """The same record, which goes on without the log and without the watcher."""
        robot, events = deepcopy(self._robot, memo), deepcopy(self._events, memo)
        twin = RunRecord(robot, None, watch=lambda record: None, cones=False, events=events)
        twin._trajectory = deepcopy(self._trajectory, memo)
        twin._hash = self._hash.copy()
        return twin

    def __len__(self) -> int:
        """The number of ticks."""
        return len(self._trajectory)

    def note(self, *events: messages.Event) -> None:
        """Events that belong to the next tick, or to the end of the run where no tick follows."""
        self._events.note(*events)

    def strand(self, people: tuple[int, ...]) -> None:
        """Who stay away for good, of those who were to come again; each is an event once."""
        self._events.strand(people)

    def add(
        self,
        k: int,
        truth: messages.WorldState,
        readings: tuple[messages.Reading, ...],
        beliefs: messages.Beliefs | None,
        observation: messages.Observation | None,
        decision: messages.Decision,
        command: messages.Array,
        *,
        asked: messages.Observation | None,
    ) -> None:
        """Everything that tick `k` saw and did; `asked` is what the controller saw, if the decision is its own."""
        believed = b"" if beliefs is None else beliefs.robot.mean.tobytes()
        self._hash.update(truth.robot_pose.tobytes() + believed + command.tobytes())
        record = messages.TickRecord(
            tick=k,
            truth=truth,
            reading=readings[-1] if readings else None,
            readings_before=readings[:-1],
            belief=None if beliefs is None else beliefs.robot,
            tracks=() if beliefs is None else beliefs.people,
            detections=beliefs.detections if beliefs is not None and readings else (),
            observation=observation,
            decision=decision,
            command=command,
            cone=self._cone(observation, beliefs, asked, decision) if self._cones else None,
            events=self._events.of_tick(truth, beliefs, decision, updated=bool(readings), given=asked is None),
        )
        self._trajectory.add(record)
        if self._recorder is not None:
            self._recorder.write(record)
        self._watch(record)

    def add_timing(self, k: int, watch: Stopwatch, start: Start) -> None:
        """How long the phases of tick `k` took."""
        timing = messages.TickTiming(k, watch.phases, start.lateness, start.missed)
        self._trajectory.add_timing(timing)
        if self._recorder is not None:
            self._recorder.write_timing(timing)

    def finish(
        self, final: messages.WorldState, state_hash: str, *, go_on: bool = False
    ) -> tuple[messages.Trajectory, str]:
        """The trajectory, and the hash of all states, of which `state_hash` is the world's last.

        No tick may follow, unless the record is to `go_on`.
        """
        digest = self._hash.copy()
        digest.update(state_hash.encode())
        trajectory = deepcopy(self._trajectory) if go_on else self._trajectory
        return trajectory.finish(final), digest.hexdigest()

    @property
    def log_dropped(self) -> int:
        """How many parts of ticks the log could not take in time."""
        return self._recorder.dropped if self._recorder else 0

    def end_log(self, final: messages.WorldState, summary: RunSummary, replay: Scenario | None) -> None:
        """Writes the log's last state, its last events, the result and the scenario of a replay, if it has its own."""
        if self._recorder is not None:
            events = self._events.at_end(final, str(summary.figures["outcome"]), self.log_dropped)
            self._recorder.finish(final, summary.document(), events, replay)

    def _cone(
        self,
        seen: messages.Observation | None,
        beliefs: messages.Beliefs | None,
        asked: messages.Observation | None,
        decision: messages.Decision,
    ) -> messages.ConeDistribution | None:
        if beliefs is None or asked is None or seen is None:
            return None
        found = self._robot.controller.closest_cone(asked, decision)
        if found is None:
            return None
        obstacle, samples, desired = found
        samples, desired = (sealed(np.asarray(values, float)) for values in (samples, desired))
        standing = obstacle - len(beliefs.people)
        if standing < 0:
            name = beliefs.people[obstacle].name
        else:
            name = self._robot.floor_map.disc_names(mean_position(seen.robot_pose))[standing]
        return messages.ConeDistribution(name, samples, desired, float((samples <= 0.0).mean()))
