"""Every method has the parameters that change what it decides, and no others."""

from dataclasses import fields

import numpy as np
import pytest

from mjnav.control import make_controller, names
from mjnav.errors import InvalidValue
from mjnav.messages import RobotLimits

LIMITS = RobotLimits(min_speed=-0.2)
OTHER = {  # than the default and than a preset's value
    "approach_time": 4.0, "ball": 0.4, "bandwidth": 0.5, "clearance": 1.0, "clip": 0.5, "degree": 4, "delta": 0.4,
    "desired_min": 60, "effective_centre": 0.4, "effort_weight": 0.9, "eta": 0.55, "fading": 1.0, "form": "ray",
    "goal_weight": 0.7, "hold": 1.0, "heading_weight": 2.0, "horizon": 1.0, "knots": 4,
    "lane_horizon": 3.0, "lane_weights": (3.0, 20.0), "margin": 0.35, "margin_growth": 0.25, "max_obstacles": 1,
    "moving": True, "num_components": 3, "num_iterations": 3, "num_omega": 6, "num_speeds": 4, "num_turn_rates": 4,
    "num_v": 6, "offset": 2.0, "penalty": 4.0, "preferred_speed": 0.4, "preview": 0.7, "progress_weight": 3.0,
    "responsibility": 0.5, "risk_bound": 1.0, "rollouts": 30, "root": True, "safety_margin": 0.3, "scale": 2.0,
    "sensing_range": 1.0,
    "speed_change_weight": 0.7, "speed_noise": 0.1, "spread": 2.0, "standing_margin": 0.3, "std_floor": 0.2,
    "step": 0.3, "steps": 12, "tail": "quantile", "temperature": 0.005, "time_horizon": 1.0, "turn_change_weight": 0.7,
    "turn_noise": 0.2, "wall_horizon": 4.0, "weight": 7.0, "window": "bounds",
}  # fmt: skip
# What acts under another parameter's value alone, and that value.
UNDER = {"horizon": {"form": "segment"}, "offset": {"degree": 3}, "ball": {"desired_min": 60}}
# Read by the loop, which draws so many: test_tick proves it.
BY_THE_LOOP = {"samples"}


def parameters_of(name):
    return make_controller(name, LIMITS, 0.1).parameters


def keys_of(name):
    return {f.name for f in fields(parameters_of(name))}


def decided(name, observation, parameters):
    """Everything that a decision says, as bytes."""
    decision = make_controller(name, LIMITS, 0.1, **parameters).decide(observation)
    c = decision.costs
    costs = () if c is None else (c.v, c.omega, c.goal, c.cone, c.lane, c.total, np.array(c.nominal))
    return decision.v, decision.omega, decision.status, *(part.tobytes() for part in costs)


@pytest.fixture(scope="module")
def observations(observe):
    return [
        observe(seed, near=near, far=far, num_obstacles=4, num_walls=2)
        for seed, (near, far) in enumerate([*((1.0, 5.0), (0.5, 1.5), (2.0, 6.0), (0.4, 0.8)) * 3, *((3.0, 8.0),) * 3])
    ]


@pytest.mark.parametrize("name", names())
def test_every_parameter_changes_a_decision(name, observations):
    idle = []
    for key in sorted(keys_of(name) - BY_THE_LOOP):
        given = UNDER.get(key, {})
        other = not parameters_of(name).normalise if key == "normalise" else OTHER[key]
        if other == getattr(parameters_of(name), key):
            other = {"form": "line", "window": "reachable", "moving": False, "root": False, "tail": "cantelli"}[key]
        if not any(decided(name, o, given) != decided(name, o, {**given, key: other}) for o in observations):
            idle.append(key)
    assert idle == []


@pytest.mark.parametrize("name", names())
def test_a_parameter_that_only_other_methods_have_is_refused(name):
    for key in sorted({key for other in names() for key in keys_of(other)} - keys_of(name)):
        with pytest.raises(InvalidValue) as raised:
            make_controller(name, LIMITS, 0.1, **{key: 1})
        assert str(raised.value).startswith(f"{key}: found {key!r}; allowed: parameters of {name}: approach_time, ")
