"""The people of a scene as inspection and pages name them: how they walk, and how they take the robot."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from mjnav.metrics.fault import sees_robot
from mjnav.scenarios.people import Person
from mjnav.scenarios.people.temperament import REGULAR
from mjnav.scenarios.spec import BEHAVIOURS, Scenario


@dataclass(frozen=True, slots=True)
class ShownPerson:
    """How a person walks, takes the robot, and when they come and go."""

    behaviour: str  # its name in run files
    temperament: str
    sees_robot: bool  # and takes account of it
    enters_s: float
    leaves_s: float | None

    @property
    def words(self) -> str:
        """Behaviour, temperament where it is not the regular one, and sight, such as "orca, scared, sees the robot"."""
        parts = [self.behaviour, *([self.temperament] if self.temperament != REGULAR else [])]
        return ", ".join([*parts, "sees the robot" if self.sees_robot else "takes no account of the robot"])


def shown_people(scenario: Scenario) -> list[ShownPerson]:
    """The people of a scene, in order."""
    return [
        ShownPerson(_behaviour(person), person.temperament or REGULAR, sees, person.enters or 0.0, person.leaves)
        for person, sees in zip(scenario.people, sees_robot(scenario), strict=True)
    ]


def _behaviour(person: Person) -> str:
    own = type(person.behaviour)
    return next((name for name, kind in BEHAVIOURS.items() if kind is own), getattr(person.behaviour, "name", ""))


def people_lines(people: Sequence[ShownPerson]) -> Iterator[str]:
    """A line for all people who are alike, such as "0, 3 to 5: orca, scared, sees the robot"."""
    alike: dict[str, list[int]] = {}
    for i, person in enumerate(people):
        alike.setdefault(person.words, []).append(i)
    for words, numbers in alike.items():
        yield f"{', '.join(_ranges(numbers))}: {words}"


def _ranges(numbers: Sequence[int]) -> Iterator[str]:
    """Numbers in order as "0" and "3 to 5"."""
    starts = [number for number in numbers if number - 1 not in numbers]
    ends = [number for number in numbers if number + 1 not in numbers]
    for first, last in zip(starts, ends, strict=True):
        yield f"{first}" if first == last else f"{first} to {last}"
