"""The people of a scene in words."""

from mjnav.report.inspection import ShownPerson, people_lines


def test_people_who_are_alike_share_a_line():
    blind, scared = (
        ShownPerson("waypoints", "regular", False, 0.0, None),
        ShownPerson("orca", "scared", True, 2.0, 7.0),
    )
    assert list(people_lines([blind, scared, scared, scared, blind])) == [
        "0, 4: waypoints, takes no account of the robot",
        "1, 2, 3: orca, scared, sees the robot",
    ]
