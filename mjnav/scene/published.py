"""The table [published]: a case of a published crowd draws the robot's start and goal and all people.

    [published]
    crowd = "crowdnav-plus"
    case = 3                 # by default the run's seed

How the cases are drawn and how their people walk is in `mjnav.motion.published_crowds`. Reading the scenario puts the
robot and the people of the case in their places, as a random scene's draws do.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from mjnav.errors import InvalidValue
from mjnav.geometry.angles import wrap
from mjnav.motion.published_crowds import CROWDS, HORIZON, MAX_CASE, ROBOT_RADIUS, CrowdRules, PublishedCrowd
from mjnav.settings import Choice, Range, Settled, below, settled

_NOTHING = "nothing beside [published]: the case gives the robot's start and goal, and all people"


@dataclass(frozen=True, slots=True)
class Published(Settled):
    """A crowd that others published, and its case; the people do not see the robot and meet no bodies."""

    crowd: Annotated[str, Choice(CROWDS), "whose people, draws and way of judging contacts hold"]
    case: Annotated[
        Annotated[int, Range(0, MAX_CASE)] | None,
        "by default the run's seed; the first 500 of crowdnav and 250 of the others are the published ones",
    ] = None

    @property
    def rules(self) -> CrowdRules:
        """The crowd's constants."""
        return CROWDS[self.crowd]

    def made(self) -> PublishedCrowd:
        """The crowd at the beginning of the case."""
        return PublishedCrowd(self.crowd, self.case or 0)

    @property
    def places(self) -> dict[str, Any]:
        """The case's own part of a run file: the robot's start and goal, and the people."""
        crowd = self.made()
        common = {"behaviour": "orca", "sees_robot": False, "loop": False, "personal_space": 0.0}
        common |= {"time_horizon": HORIZON, "max_neighbours": len(crowd.position) - 1}
        columns = (crowd.position, crowd.goal, crowd.radius, crowd.max_speed)
        people = [
            {"start": start, "waypoints": [goal], "radius": radius, "speed": min(speed, 1.0), **common}
            for start, goal, radius, speed in zip(*(column.tolist() for column in columns), strict=True)
        ]
        start = [*crowd.robot_pose[:2].tolist(), wrap(crowd.robot_pose[2])]
        return {"robot": {"start": start, "goal": crowd.robot_goal.tolist()}, "people": people}


def is_open(document: Mapping[str, Any]) -> bool:
    """Whether a run file names a case whose people are still to be put in."""
    robot = document.get("robot")
    is_put = isinstance(robot, Mapping) and "start" in robot and bool(document.get("people"))
    return "published" in document and not is_put


def put_case(document: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """The tables with the case's robot and people. Raises InvalidValue."""
    with below("published"):
        published = settled(Published, document["published"])
        case = settled(Published, {"crowd": published.crowd, "case": seed}) if published.case is None else published
    robot = document.get("robot", {})
    for table, key in ((robot, "start"), (robot, "goal"), (robot, "waypoints"), (document, "people")):
        if isinstance(table, Mapping) and table.get(key):
            full, found = ("people", f"{len(table[key])} of them") if key == "people" else (f"robot.{key}", table[key])
            raise InvalidValue(full, found, _NOTHING)
    places = case.places
    robot = {**robot, **places["robot"]} if isinstance(robot, Mapping) else robot
    table = {"crowd": case.crowd, "case": case.case}
    return {**document, "published": table, "robot": robot, "people": places["people"]}


def check_case(published: Published, scenario: Any) -> None:
    """Raises InvalidValue for a scenario that cannot hold the case as it was published."""
    if published.case is None:
        raise InvalidValue("robot.start", scenario.robot.start, _NOTHING)
    robot, physics, places = scenario.robot, scenario.physics, published.places
    why = f"beside [published]: the people of {published.crowd} are moved as published"
    if physics.engine != "kinematic":
        raise InvalidValue("physics.engine", physics.engine, f'"kinematic" {why}')
    steps = published.rules.period / physics.timestep
    if abs(steps - round(steps)) > 1e-6 * steps:
        raise InvalidValue("physics.timestep", physics.timestep, f"a whole part of {published.rules.period:g} s")
    if robot.radius != ROBOT_RADIUS:
        raise InvalidValue("robot.radius", robot.radius, f"{ROBOT_RADIUS:g} {why}")
    if scenario.people_see_robot:
        raise InvalidValue("people_see_robot", True, f"false or nothing {why}")
    for kind in ("walls", "tables", "pillars"):
        if getattr(scenario, kind):
            raise InvalidValue(kind, len(getattr(scenario, kind)), f"none {why}")
    found = {"start": list(robot.start), "goal": None if robot.goal is None else list(robot.goal)}
    for key, value in found.items():
        if value != places["robot"][key]:
            raise InvalidValue(f"robot.{key}", value, f"{places['robot'][key]}, of case {published.case}")
    people = [{"start": list(person.start), "radius": person.radius} for person in scenario.people]
    if people != [{key: person[key] for key in ("start", "radius")} for person in places["people"]]:
        raise InvalidValue("people", f"{len(people)} of them", f"those of case {published.case}, or none")
