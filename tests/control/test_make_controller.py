from math import inf, nan

import pytest

from mjnav.control import describe, make_controller, names
from mjnav.control.methods.rkhs import RkhsParameters
from mjnav.control.parameters import Parameters
from mjnav.control.registry import METHODS, shipped_parameters
from mjnav.errors import InvalidValue
from mjnav.messages import RobotLimits


def test_the_names_are_sorted_and_each_makes_a_controller(limits):
    assert names() == tuple(sorted(METHODS))
    assert set(describe()) == set(names())
    for name in names():
        assert callable(make_controller(name, limits, 0.1).decide)


def test_rkhs_paper_is_the_literal_method(limits):
    p = make_controller("rkhs-paper", limits, 0.125).parameters
    assert (p.form, p.degree, p.scale, p.offset) == ("line", 3, 1.0, 1.0)
    assert (p.normalise, p.clip, p.sensing_range) == (False, inf, inf)
    assert p.max_obstacles >= 100_000
    assert (p.desired_min, p.heading_weight, p.safety_margin) == (0, 0.0, 0.0)
    assert (p.preview, p.lane_horizon) == (0.125, 0.125)


# Its margins are part of the violation, its samples are joint; the margin of mppi-plus was tuned with its weights.
OWN = {"rkhs-plan": {"safety_margin", "samples"}, "mppi-plus": {"safety_margin"}}


def test_the_shared_parameters_are_the_same_in_every_class():
    rkhs = RkhsParameters()
    for name, method in METHODS.items():
        other = method.controller_class.parameters_type()
        both = set(Parameters.__dataclass_fields__) & set(type(other).__dataclass_fields__)
        assert {"samples", "preferred_speed", "approach_time", "sensing_range"} < both
        assert {key for key in both if getattr(rkhs, key) != getattr(other, key)} == OWN.get(name, set()), name
    assert (rkhs.num_v, rkhs.num_omega, rkhs.samples, rkhs.max_obstacles, rkhs.safety_margin) == (
        20,
        20,
        25,
        None,
        0.05,
    )


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("rkhz", {}, "method: found 'rkhz'; allowed: cvar, dwa, gaussian-linearised, "),
        ("rkhs", {"weigth": 1.0}, "did you mean 'weight'?"),
        ("mean", {"degree": 2}, "degree: found 'degree'; allowed: parameters of mean: approach_time, form, heading"),
        ("rkhs", {"weight": "heavy"}, "weight: found 'heavy'; allowed: a number"),
        ("rkhs", {"form": "lime"}, "form: found 'lime'; allowed: line, ray, segment; did you mean 'line'?"),
        ("rkhs", {"degree": 0}, "degree: found 0; allowed: a whole number from 1 to 10"),
        ("rkhs", {"lane_weights": [1.0, -2.0]}, "lane_weights.1: found -2.0; allowed: a number from 0 to"),
        ("cvar", {"eta": nan}, "eta: found nan; allowed: a number from 0 to 1"),
        ("rkhs", {"name": "x"}, "name: found 'name'; allowed: parameters of rkhs: "),
        ("rkhs", {"period": 0.1}, "period: found 'period'; allowed: parameters of rkhs: "),
        ("rkhs", {"robot_limits": 1}, "robot_limits: found 'robot_limits'; allowed: parameters of rkhs: "),
    ],
)
def test_what_cannot_be_is_refused_with_what_is_allowed(limits, name, parameters, message):
    with pytest.raises(InvalidValue) as error:
        make_controller(name, limits, 0.1, **parameters)
    assert message in str(error.value)


@pytest.mark.parametrize("period", [0.0, -0.1, nan, inf, None, "fast", 10**400])
def test_a_period_that_is_none_is_refused(limits, period):
    with pytest.raises(InvalidValue, match="period: found"):
        make_controller("rkhs", limits, period)


@pytest.mark.parametrize("name", names())
def test_a_class_is_named_by_its_place_and_has_its_own_defaults(name, limits):
    place = f"mjnav.control.methods.{METHODS[name].place}"
    made = make_controller(place, limits, 0.1)
    assert type(made) is METHODS[name].controller_class
    assert made.parameters == type(made.parameters)()
    assert shipped_parameters(place, 0.1) == made.parameters


TUNED = {  # weights of a change of speed and of turn rate at 10 Hz
    "cvar": (0.0443, 0.117), "dwa": (0.0467, 0.00867), "gaussian-linearised": (0.137, 0.0102),
    "gaussian-moments": (0.0169, 0.00329), "kld": (0.0326, 0.0152), "mean": (0.0241, 0.0392),
    "mmd-dirac": (0.101, 0.0437), "mppi": (0.246, 0.012), "rkhs": (0.0151, 0.0366), "rkhs-reading": (0.0328, 0.0188),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted({*names()} - {"orca"}))
def test_the_weights_of_a_change_follow_the_period_unless_they_are_given(name, limits):
    at_10, at_50 = (make_controller(name, limits, period).parameters for period in (0.1, 0.02))
    speed, turn = at_10.speed_change_weight, at_10.turn_change_weight
    assert (speed, turn) == TUNED.get(name, (0.01, 0.01))
    assert (at_50.speed_change_weight, at_50.turn_change_weight) == pytest.approx((0.2 * speed, 0.2 * turn))
    given = make_controller(name, limits, 0.02, speed_change_weight=0.5).parameters
    assert (given.speed_change_weight, given.turn_change_weight) == (0.5, pytest.approx(0.2 * turn))


@pytest.mark.parametrize(("max_speed", "reach"), [(0.2, 7.0), (1.0, 7.0), (2.0, 12.0), (3.0, 17.0)])
def test_by_default_every_disc_counts_that_a_robot_of_that_speed_may_meet(max_speed, reach):
    p = make_controller("rkhs", RobotLimits(max_speed=max_speed), 0.1, preferred_speed=0.2).parameters
    assert p.reach(max_speed) == reach
    assert p.max_obstacles is None
    assert make_controller("rkhs", RobotLimits(), 0.1, sensing_range=3.0).parameters.reach(max_speed) == 3.0
