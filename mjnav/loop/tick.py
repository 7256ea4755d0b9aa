"""One tick of the loop: what the robot does once every control period T, at t = k T.

    sense      z            readings of all sensors since the tick before
    estimate   b = p(x | z) weighted particles of the robot's pose and of each person's position and velocity
    predict    o            N samples of the robot and of each person, carried to the moment at which u* takes effect
    control    u* = (v, w)  the controller's decision on o, within the robot's limits
    actuate    u(t)         the command in force now, and those that take force within the period
    record     all of this, in memory and in the log

Then the world moves on by T under u(t). `simulation` composes what a tick needs and says when a run ends.
"""

from functools import cached_property

from mjnav.loop.onboard.navigator import Navigator
from mjnav.loop.pacer import Stopwatch
from mjnav.loop.run_record import RunRecord
from mjnav.messages import Beliefs, Decision, Observation, Reading, WorldState
from mjnav.sealed import twin
from mjnav.world.simulator import Simulator


class Tick:
    """Tick `k`. Each part is computed when it is first asked for, after the parts before it, and once."""

    def __init__(self, k: int, before: Beliefs | None, *, world: Simulator, robot: Navigator, watch: Stopwatch):
        """`before` are the estimators' beliefs after the tick before; `watch` times the parts.

        The truth is the world's state at t. It is recorded; the robot never sees it.
        """
        self.k, self._before = k, before
        self._given: Beliefs | None = None
        self._recorded: Observation | None = None  # a twin: the controller may change the one it was shown
        self._world, self._robot, self._watch = world, robot, watch
        watch.start()
        self.truth: WorldState = world.state()
        watch.lap("truth")

    @property
    def messages(self) -> tuple[object, ...]:
        """What is known so far and never changes: two ticks may share it."""
        known = vars(self)
        found = [known.get(name) for name in ("truth", "observation", "_recorded", "decision")]
        for beliefs in (known.get("estimated"), self._given, self._before):
            found += [] if beliefs is None else [beliefs, beliefs.robot, *beliefs.people]
        return (*found, *known.get("readings", ()))

    @cached_property
    def readings(self) -> tuple[Reading, ...]:
        """What the sensors measured since the tick before."""
        self._watch.resume()
        readings = self._world.sense()
        self._watch.lap("readings")
        return readings

    @cached_property
    def estimated(self) -> Beliefs | None:
        """What the estimators make of the readings; None without estimators."""
        readings = self.readings
        self._watch.resume()
        beliefs = self._robot.estimate(readings, self._before)
        self._watch.lap("estimate")
        return beliefs

    @property
    def beliefs(self) -> Beliefs | None:
        """Those that were handed over, or else the estimators'."""
        return self.estimated if self._given is None else self._given

    @cached_property
    def observation(self) -> Observation | None:
        """What a controller may know; None without beliefs."""
        beliefs = self.beliefs
        if beliefs is None:
            return None
        self._watch.resume()
        observation = self._robot.predict(self.k, beliefs, own=self._given is None)
        self._recorded = twin(observation)
        self._watch.lap("predict")
        return observation

    def believe(self, beliefs: Beliefs) -> None:
        """Puts somebody else's beliefs in the place of the estimators'; what followed from those is forgotten."""
        _ = self.estimated  # the estimators hear every reading
        self._robot.follow_route(beliefs.robot.mean)
        self._given = beliefs
        self.__dict__.pop("observation", None)
        self.__dict__.pop("decision", None)

    @cached_property
    def decision(self) -> Decision:
        """The controller's."""
        observation = self.observation
        assert observation is not None, "a controller decides on an observation"
        self._watch.resume()
        decision = self._robot.decide(observation)
        self._watch.lap("decide")
        return decision

    def act(self, decision: Decision, record: RunRecord) -> None:
        """Acts on a decision within the limits: puts it under way, records the tick and moves the world on."""
        robot, watch = self._robot, self._watch
        observation, beliefs = self.observation, self.beliefs
        if beliefs is None:
            robot.follow_route(self.truth.robot_pose)
        watch.resume()
        command, switches = robot.actuate(self.k, decision, watch.elapsed)
        watch.lap("actuate")
        record.strand(self._world.stranded)
        record.note(*robot.take_events())
        asked = observation if decision is self.__dict__.get("decision") else None
        record.add(self.k, self.truth, self.readings, beliefs, self._recorded, decision, command, asked=asked)
        watch.lap("write")
        self._world.advance(robot.period, command, switches)
        watch.lap("advance")
