"""What was and will be commanded, by time."""

import numpy as np
import pytest

from mjnav.robot.latency import CommandHistory

DELAYS = (0, 1, 3)


@pytest.mark.parametrize("delay", DELAYS)
def test_a_decision_takes_force_after_the_delay_and_zero_commands_before_it(limits, delay):
    history = CommandHistory(limits)
    decisions = [np.array([0.1 * k, 0.2]) for k in range(1, 6)]
    for tick, decision in enumerate(decisions):
        history.append((tick + delay) * 0.1, decision)
        expected = decisions[tick - delay] if tick >= delay else np.zeros(2)
        assert np.array_equal(history.in_force(0.1 * tick), expected)


@pytest.mark.parametrize("delay", DELAYS)
def test_the_stretches_reach_from_the_belief_to_the_moment_of_effect_without_a_gap(limits, delay):
    history = CommandHistory(limits)
    for tick in range(12):
        effect = (tick + delay) * 0.1
        for lag in (0.0, 0.04, 0.1, 0.13):  # the reading may be older than the tick
            start = max(0.0, tick * 0.1 - lag)
            stretches = history.stretches(start, effect)
            if effect - start < 1e-9:
                assert stretches == []
                continue
            assert stretches[0].start == pytest.approx(start)
            assert stretches[-1].end == pytest.approx(effect)
            assert [a.end for a in stretches[:-1]] == pytest.approx([b.start for b in stretches[1:]])
        history.append(effect, np.array([0.05 * tick, 0.0]))


@pytest.mark.parametrize("period", [0.02, 0.1, 0.2])
def test_set_points_follow_a_fine_simulation_of_the_ramp(limits, period):
    rng = np.random.default_rng(1)
    commands = rng.uniform([0.0, -1.5], [1.0, 1.5], (40, 2))
    history = CommandHistory(limits)
    for j, command in enumerate(commands):
        history.append(j * period, command)
    num, limit = 400, np.array([limits.max_acceleration, limits.max_turn_acceleration])
    step = period / num
    value = np.zeros(2)
    for j, command in enumerate(commands):
        for i in range(num):
            if i in (0, num // 3):
                stretch = history.stretches(j * period + i * step, (j + 1) * period)[0]
                assert stretch.set_point == pytest.approx(value, abs=1e-9 + limit.max() * step)
            value = value + np.clip(command - value, -limit * step, limit * step)


def test_commands_switch_within_a_period_in_order_and_none_overtakes_another(limits):
    history = CommandHistory(limits)
    first, second, third = np.array([0.1, 0.0]), np.array([0.2, 0.0]), np.array([0.3, 0.0])
    history.append(0.13, first)
    history.append(0.27, second)
    history.append(0.22, third)  # computed sooner, but it waits for its turn
    assert np.array_equal(history.in_force(0.1), [0.0, 0.0])
    assert [(pytest.approx(0.03), 0.1)] == [(at, c[0]) for at, c in history.switches(0.1, 0.2)]
    assert [(at, c[0]) for at, c in history.switches(0.2, 0.3)] == [
        (pytest.approx(0.07), 0.2),
        (pytest.approx(0.07), 0.3),
    ]
    assert history.switches(0.3, 0.4) == []
    assert np.array_equal(history.in_force(0.3), third)
    assert [s.command[0] for s in history.stretches(0.1, 0.3)] == [0.0, 0.1, 0.3]
