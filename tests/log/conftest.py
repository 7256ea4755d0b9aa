"""Made-up ticks of the size that a real run has."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass

import mjnav
from mjnav.log import Log, Recorder, open_log
from mjnav.messages import (
    CandidateCosts,
    ConeDistribution,
    Contact,
    Decision,
    Event,
    Observation,
    PlanShown,
    Reading,
    RobotBelief,
    Status,
    TickRecord,
    TickTiming,
    Track,
    WorldState,
)
from mjnav.scene.spec import ConstantVelocity, LaneSpec, Person, Pillar, Robot, Scenario, Table, Wall

PERIOD = 0.1


def make_scenario(num_people: int = 5) -> Scenario:
    return Scenario(
        name="made-up",
        robot=Robot(start=(0.0, 0.0, 0.0), goal=(10.0, 0.0)),
        walls=tuple(Wall((-2.0, y), (12.0, y)) for y in (-3.0, 3.0)),
        tables=(Table((5.0, 1.5)), Table((7.0, -1.5), yaw=0.3)),
        pillars=(Pillar((3.0, -1.0)), Pillar((8.0, 2.0))),
        lanes=LaneSpec(left=(0.0, 1.0, -2.5), right=(0.0, 1.0, 2.5)),
        people=tuple(Person((9.0, i - 2.0), ConstantVelocity((-0.7, 0.0))) for i in range(num_people)),
    )


class MadeUpRun:
    """Ticks whose every number is drawn from a seeded generator."""

    def __init__(self, num_people: int = 5, num_candidates: int = 402, seed: int = 0):
        self.num_people, self.num_candidates = num_people, num_candidates
        self.rng = np.random.default_rng(seed)

    def truth(self, tick: int, contacts: tuple[Contact, ...] = ()) -> WorldState:
        rng = self.rng
        return WorldState(
            time=tick * PERIOD,
            robot_pose=rng.normal(size=3),
            robot_twist=rng.normal(size=2),
            people_position=rng.normal(size=(self.num_people, 2)),
            people_velocity=rng.normal(size=(self.num_people, 2)),
            contacts=contacts,
        )

    def record(self, tick: int, **changes) -> TickRecord:
        rng, time, k = self.rng, tick * PERIOD, self.num_candidates
        costs = CandidateCosts(
            v=np.repeat(np.linspace(0.0, 1.0, 21), 20)[:k],
            omega=np.tile(np.linspace(-1.5, 1.5, 20), 21)[:k],
            goal=rng.random(k),
            cone=rng.random((k, 7)),
            lane=rng.random((k, 2)),
            total=rng.random(k),
            nominal=int(rng.integers(k)),
        )
        chosen = int(np.argmin(costs.total))
        mean = rng.normal(size=3)
        record = TickRecord(
            tick=tick,
            truth=self.truth(tick),
            reading=Reading(
                time=time,
                interval=PERIOD if tick else 0.0,
                odometry=rng.normal(size=2),
                gyro=float(rng.normal()),
                pose=rng.normal(size=3),
                detections=rng.normal(size=(self.num_people, 2)),
                scan=np.where(rng.random(360) < 0.1, np.inf, rng.uniform(0.2, 10.0, 360)),
            ),
            belief=RobotBelief(
                time=time,
                particles=mean + 0.02 * rng.normal(size=(500, 3)),
                weights=np.full(500, 1 / 500),
                mean=mean,
                covariance=np.diag(rng.uniform(0.001, 0.01, 3)),
                ess=float(rng.uniform(100, 500)),
            ),
            tracks=tuple(self._track(i, time) for i in range(self.num_people)),
            observation=Observation(
                robot_pose=rng.normal(size=(25, 3)),
                control_noise=rng.normal(size=(25, 2)),
                twist=rng.normal(size=2),
                obstacles=(),
                goal=np.array([10.0, 0.0]),
                time=time,
            ),
            decision=Decision(float(costs.v[chosen]), float(costs.omega[chosen]), Status.OK, costs),
            command=rng.normal(size=2),
            cone=ConeDistribution("person1", rng.normal(size=625), rng.normal(size=400), float(rng.random())),
        )
        return replace(record, **changes)

    def plan(self, num_rollouts: int = 32, num_steps: int = 20, num_samples: int = 48) -> PlanShown:
        rng = self.rng
        return PlanShown(
            step=0.2,
            path=rng.normal(size=(num_steps, 2)),
            fan=rng.normal(size=(num_rollouts, num_steps, 2)),
            fan_cost=np.sort(rng.random(num_rollouts)),
            violation=np.maximum(rng.normal(size=num_samples), 0.0).clip(max=2.0),
            feasible=bool(rng.random() < 0.5),
        )

    def planned(self, tick: int, **sizes: int) -> TickRecord:
        """A tick of a method that plans ahead."""
        record = self.record(tick)
        return replace(record, decision=replace(record.decision, plan=self.plan(**sizes)))

    @staticmethod
    def at(record: TickRecord, tick: int) -> TickRecord:
        """The same record at another tick."""
        return replace(record, tick=tick, truth=replace(record.truth, time=tick * PERIOD))

    def _track(self, i: int, time: float) -> Track:
        particles = self.rng.normal(size=(200, 4))
        return Track(
            name=f"person{i}",
            time=time,
            particles=particles,
            weights=np.full(200, 1 / 200),
            mean=particles.mean(0),
            covariance=np.cov(particles.T),
            ess=float(self.rng.uniform(50, 200)),
            radius=0.3,
        )

    def timing(self, tick: int) -> TickTiming:
        phases = tuple(int(value) for value in self.rng.integers(1_000, 5_000_000, 5))
        return TickTiming(tick, phases, int(self.rng.integers(0, 9_000)), deadline_missed=tick % 7 == 3)


def made_up_log(path: Path, num_ticks: int, num_people: int = 2, num_candidates: int = 5) -> Path:
    """A log with a chunk for every three ticks."""
    run = MadeUpRun(num_people, num_candidates)
    with Recorder(path, make_scenario(num_people), {"seed": "3", "scene": "made-up"}, "<mujoco/>") as recorder:
        for tick in range(num_ticks):
            recorder.write(run.record(tick))
            recorder.write_timing(run.timing(tick))
            if tick % 3 == 2:
                recorder._writer.flush()
        recorder.finish(run.truth(num_ticks), {"outcome": "goal", "ticks": num_ticks, "deadline_misses": 1})
    return path


@pytest.fixture
def scenario() -> Scenario:
    return make_scenario()


@pytest.fixture
def made_up() -> MadeUpRun:
    return MadeUpRun()


def message_class(schema):
    """The class of a protobuf message from the schema that a log carries."""
    pool = DescriptorPool()
    for file in FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    return GetMessageClass(pool.FindMessageTypeByName(schema.name))


@pytest.fixture
def contact() -> Contact:
    return Contact("person", "person2", 12.5, 0.43)


@pytest.fixture
def event() -> Event:
    return Event("warning", "contact", "the robot touches person2")


@pytest.fixture(scope="session")
def recorded(tmp_path_factory) -> Path:
    """The log of six made-up ticks; the third has only what every tick has, and one track's state is not finite."""
    run, path = MadeUpRun(num_people=3, num_candidates=21), tmp_path_factory.mktemp("recorded") / "a.mcap"
    touched = (Contact("person", "person2", 12.5, 0.43),)
    with Recorder(path, make_scenario(3), {"scene": "made-up", "seed": "3"}, "<mujoco/>") as recorder:
        for tick in range(6):
            record = run.record(tick, events=(Event("warning", "contact", f"the robot, again: {tick}"),))
            if tick == 2:
                decision = replace(record.decision, costs=None, status=Status.INFEASIBLE)
                record = replace(
                    record, decision=decision, reading=None, cone=None, tracks=record.tracks[1:], events=()
                )
            if tick == 3:
                record = replace(record, truth=replace(record.truth, contacts=touched))
            if tick == 4:
                lost = replace(record.tracks[0], mean=np.full(4, np.nan))
                record = replace(record, tracks=(lost, *record.tracks[1:]))
            recorder.write(record)
            recorder.write_timing(run.timing(tick))
        recorder.finish(run.truth(6, contacts=touched * 2), {"outcome": "goal"})
    return path


@pytest.fixture(scope="session")
def driven(tmp_path_factory) -> Log:
    """The log of two seconds of a real run."""
    path = tmp_path_factory.mktemp("driven") / "a.mcap"
    mjnav.run(mjnav.load_scenario("crossing1", ["time_limit=2.0", "physics.engine=kinematic"]), log=path)
    return open_log(path)


@pytest.fixture(scope="session")
def whole(tmp_path_factory) -> Path:
    """A log of twelve made-up ticks in several chunks."""
    return made_up_log(tmp_path_factory.mktemp("whole") / "whole.mcap", 12, num_people=1, num_candidates=5)
