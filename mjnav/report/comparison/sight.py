"""Whether the people of a table see the robot: what a method does among people who give way says nothing of others."""

from collections.abc import Sequence

MAX_NAMED = 3


def sight(people: Sequence[str]) -> str:
    """In words, from the values of `people_see_robot` in a table's rows; "" without people or where it is not known."""
    match tuple(people):
        case ():
            return ""
        case ("all",):
            return "people see the robot"
        case ("none",):
            return "people do not see the robot"
        case (one,):
            return f"{one} people see the robot"
        case several:
            more = f" and {len(several) - MAX_NAMED} more" if len(several) > MAX_NAMED else ""
            return f"people see the robot by seed: {', '.join(several[:MAX_NAMED])}{more}"


def of_table(people: Sequence[str]) -> str | None:
    """The same as one value for programs: "all", "none", "3 of 5", or several with commas; None where there is none."""
    return ", ".join(people) or None
