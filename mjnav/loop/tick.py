"""One tick of the loop: what the robot does once every control period T, at t = k T.

    sense      z            readings of all sensors since the tick before
    estimate   b = p(x | z) weighted particles of the robot's pose and of each person's position and velocity
    predict    o            N samples of the robot and of each person, carried to the moment at which u* takes effect
    decide     u* = (v, w)  the controller's decision on o, within the robot's limits
    actuate    u(t)         the command in force now, and those that take force within the period
    record     all of this, in memory and in the log
    advance                 the world moves on by T under u(t)

`simulation` composes what a tick needs and says when a run ends.
"""

from mjnav.loop.pacer import Stopwatch
from mjnav.loop.run_record import RunRecord
from mjnav.messages import Beliefs, Decision, Observation, Reading, WorldState
from mjnav.robot.navigator import Navigator
from mjnav.sealed import sealed_message
from mjnav.world.simulator import Simulator


class Tick:
    """Tick `k`. Its methods are called in the order above: `perceive`, `predict`, `decide`, `act`.

    Who has a decision from elsewhere leaves out `decide`.
    """

    def __init__(self, k: int, before: Beliefs | None, *, world: Simulator, robot: Navigator, watch: Stopwatch):
        """`before` are the estimators' beliefs after the tick before; `watch` times the parts.

        The truth is the world's state at t. It is recorded; the robot never sees it.
        """
        self.k, self._before = k, before
        self._world, self._robot, self._watch = world, robot, watch
        self.readings: tuple[Reading, ...] | None = None  # until `perceive`
        self.perceived = False
        self.estimated: Beliefs | None = None  # by the robot's estimators; None without estimators
        self.beliefs: Beliefs | None = None  # the estimators', or those that were given to `predict`
        self.predicted: Observation | None = None  # until `predict`, and without beliefs
        self._shown: Observation | None = None  # until `observation`
        self._asked: Observation | None = None  # what the controller has decided on
        self.decision: Decision | None = None  # the controller's, until `decide`
        watch.start()
        self.truth: WorldState = world.state()
        self._stranded = world.stranded  # people who stay away for good
        watch.lap("truth")

    @property
    def messages(self) -> tuple[object, ...]:
        """What is known so far and never changes: two ticks may share it."""
        messages: list[object] = [self.truth, self.predicted, self._shown, self.decision, *(self.readings or ())]
        for beliefs in (self.estimated, self.beliefs, self._before):
            messages += [] if beliefs is None else [beliefs, beliefs.robot, *beliefs.people]
        return tuple(messages)

    @property
    def observation(self) -> Observation | None:
        """What was predicted, in objects of its own: who is shown it may change them."""
        if self._shown is None and self.predicted is not None:
            self._shown = sealed_message(self.predicted)
        return self._shown

    def perceive(self) -> None:
        """Senses and estimates."""
        watch = self._watch
        watch.resume()
        if self.readings is None:  # not None where estimating them failed before
            self.readings = self._world.sense()
        watch.lap("readings")
        self.beliefs = self.estimated = self._robot.estimate(self.readings, self._before)
        self.perceived = True
        watch.lap("estimate")

    def predict(self, beliefs: Beliefs | None = None) -> None:
        """Makes the observation, of somebody else's `beliefs` in place of the estimators'; none without beliefs."""
        self._watch.resume()
        if beliefs is not None:
            self._robot.follow_route(beliefs.robot.mean)
            self.beliefs = beliefs
        if self.beliefs is not None:
            self.predicted = self._robot.predict(self.k, self.beliefs, own=beliefs is None)
        self.decision = self._shown = None
        self._watch.lap("predict")

    def decide(self) -> Decision:
        """Asks the robot's own controller."""
        self._watch.resume()
        self._asked = self.predicted if self._robot.controller_is_shipped else self.observation
        assert self._asked is not None, "a controller decides on an observation"
        self.decision = self._robot.decide(self._asked)
        self._watch.lap("decide")
        return self.decision

    def act(self, decision: Decision, record: RunRecord) -> None:
        """Acts on a decision within the limits: puts it under way, records the tick and moves the world on."""
        robot, watch, readings = self._robot, self._watch, self.readings
        assert readings is not None, "who acts has perceived"
        if self.beliefs is None:
            robot.follow_route(self.truth.robot_pose)
        watch.resume()
        command, switches = robot.actuate(self.k, decision, watch.elapsed)
        noticed = robot.take_events()
        watch.lap("actuate")
        record.strand(self._stranded)
        record.note(*noticed)
        asked = self._asked if decision is self.decision else None
        record.add(self.k, self.truth, readings, self.beliefs, self.predicted, decision, command, asked=asked)
        watch.lap("write")
        self._world.advance(robot.period, command, switches)
        watch.lap("advance")
