"""One tick of the loop: what the robot does once every control period T, at t = k T.

    sense      z            readings of all sensors since the tick before
    estimate   b = p(x | z) weighted particles of the robot's pose and of each person's position and velocity
    predict    o            N samples of the robot and of each person, carried to the moment at which u* takes effect
    control    u* = (v, w)  the controller's decision on o, within the robot's limits
    actuate    u(t)         the command in force now, and those that take force within the period
    record     all of this, in memory and in the log

Then the world moves on by T under u(t). `episode` composes what a tick needs and decides when a run ends.
"""

from mjnav.loop.onboard.navigator import Beliefs, Navigator
from mjnav.loop.pacer import Stopwatch
from mjnav.loop.run_record import RunRecord
from mjnav.messages import WorldState
from mjnav.world.simulator import Simulator


def tick(
    k: int,
    truth: WorldState,
    beliefs: Beliefs | None,
    *,
    world: Simulator,
    robot: Navigator,
    record: RunRecord,
    watch: Stopwatch,
) -> Beliefs:
    """Tick `k`: returns the beliefs after it, from those before it, which are None in the first.

    `truth` is the world's state at t. It is recorded; the robot never sees it. `watch` times the steps.
    """
    readings = world.sense()
    watch.lap("readings")
    beliefs = robot.estimate(readings, beliefs)
    watch.lap("estimate")
    observation = robot.predict(k, beliefs)
    watch.lap("predict")
    decision = robot.decide(observation)
    watch.lap("decide")
    command, switches = robot.actuate(k, watch.elapsed)
    watch.lap("actuate")
    record.add(k, truth, readings, beliefs, observation, decision, command)
    watch.lap("write")
    world.advance(robot.period, command, switches)
    watch.lap("advance")
    return beliefs
