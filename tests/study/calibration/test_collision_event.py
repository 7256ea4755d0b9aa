"""The event's probability by pairs of samples and by joint draws: literal loops and closed forms."""

import numpy as np
import pytest
from scipy.stats import norm

from mjnav.messages import Observation, ObstacleSamples, RobotLimits
from mjnav.study.calibration import EVENT, ErrorDraws, around_truth, share_of_draws, share_of_pairs

LIMITS = RobotLimits(radius=0.25)


def random_samples(seed: int, num: int, sizes: tuple[int, ...]) -> Observation:
    rng = np.random.default_rng(seed)
    return Observation(
        robot_pose=rng.normal(scale=0.2, size=(num, 3)),
        control_noise=rng.normal(scale=0.1, size=(num, 2)),
        twist=np.zeros(2),
        obstacles=tuple(
            ObstacleSamples(
                np.array([2.0 + j, 0.4]) + rng.normal(scale=0.3, size=(m, 2)), rng.normal(scale=0.3, size=(m, 2)), 0.2
            )
            for j, m in enumerate(sizes)
        ),
        goal=np.ones(2),
        walls=np.array([[[0.5, -1.0], [0.5, 1.0]]]),  # right ahead, and of no account
    )


def touches(o: Observation, i: int, disc: ObstacleSamples, m: int, v: float, omega: float) -> bool:
    """Whether robot sample i and sample m of a disc come together: the distance at 20001 moments of 5 s."""
    heading = o.robot_pose[i, 2] + (omega + o.control_noise[i, 1]) * 0.4
    speed = v + o.control_noise[i, 0]
    time = np.linspace(0.0, 5.0, 20001)
    x = o.robot_pose[i, 0] - disc.position[m, 0] + time * (speed * np.cos(heading) - disc.velocity[m, 0])
    y = o.robot_pose[i, 1] - disc.position[m, 1] + time * (speed * np.sin(heading) - disc.velocity[m, 1])
    return bool(np.hypot(x, y).min() < 0.25 + disc.radius)


def test_the_event_is_the_shared_model_without_a_margin():
    assert (EVENT.form, EVENT.horizon, EVENT.preview, EVENT.safety_margin) == ("segment", 5.0, 0.4, 0.0)


@pytest.mark.parametrize("seed", range(3))
def test_the_share_of_pairs_is_that_of_all_combinations_of_samples(seed):
    o = random_samples(seed, 4, (3, 1, 2))
    hits = 0
    combinations = [(i, a, b, c) for i in range(4) for a in range(3) for b in range(1) for c in range(2)]
    for i, *samples in combinations:
        hits += any(touches(o, i, disc, m, 0.7, 0.2) for disc, m in zip(o.obstacles, samples, strict=True))
    assert 0 < hits < len(combinations)
    assert share_of_pairs(o, (0.7, 0.2), LIMITS) == pytest.approx(hits / len(combinations))


@pytest.mark.parametrize("seed", range(3))
def test_the_share_of_draws_takes_sample_i_of_everything_together(seed):
    o = random_samples(seed, 30, (30, 1, 30))
    hits = [any(touches(o, i, d, min(i, len(d.position) - 1), 0.7, 0.2) for d in o.obstacles) for i in range(30)]
    assert 0 < sum(hits) < 30
    assert share_of_draws(o, (0.7, 0.2), LIMITS) == pytest.approx(sum(hits) / 30)


def test_nothing_in_the_room_is_never_hit_and_what_is_touched_already_always(known):
    for share in (share_of_pairs, share_of_draws):
        assert share(known(), (1.0, 0.0), LIMITS) == 0.0
        assert share(known((3.0, 2.0, 0.0, 0.0, 0.2)), (1.0, 0.0), LIMITS) == 0.0
        assert share(known((0.1, 0.0, 0.0, 0.0, 0.2)), (0.0, 0.0), LIMITS) == 1.0


def test_discs_beyond_the_sensing_range_and_the_largest_number_count_too(known):
    far = known(*[(50.0, float(y), 0.0, 0.0, 0.2) for y in range(2, 30)], (9.0, 0.0, -2.0, 0.0, 0.3))
    assert share_of_pairs(far, (0.0, 0.0), LIMITS) == share_of_draws(far, (0.0, 0.0), LIMITS) == 1.0


# ------------------------------------------------------------------------- a risk in closed form

STD, OFFSET, RADIUS = 0.3, 0.5, 0.22 + 0.25
ACROSS = (
    "noise.profile=none",
    f'noise.pose.y={{distribution="gaussian", std={STD}}}',
)
NUM = 100_000


def passing_risk(std: float) -> float:
    """That a Gaussian lateral distance from the robot's straight line to the disc is less than R."""
    return float(norm.cdf((OFFSET + RADIUS) / std) - norm.cdf((OFFSET - RADIUS) / std))


def test_fresh_draws_collide_as_often_as_the_normal_law_says(pillar, known, true):
    scenario = pillar(*ACROSS, f"pillars.0.position=[3.0, {OFFSET}]")
    base = known((3.0, OFFSET, 0.0, 0.0, 0.25))
    fresh = around_truth(base, true(), ErrorDraws(scenario, 0, "fresh")(NUM))
    risk = passing_risk(STD)
    assert share_of_draws(fresh, (1.0, 0.0), scenario.robot.limits) == pytest.approx(
        risk, abs=4.0 * np.sqrt(risk * (1.0 - risk) / NUM)
    )


@pytest.mark.parametrize("num", [100, 1000])
def test_the_predicted_share_converges_to_the_frequency(person, known, true, num):
    scenario = person(*ACROSS, f'noise.detection.y={{distribution="gaussian", std={STD}}}', "people.0.radius=0.25")
    base, state = known((3.0, OFFSET, 0.0, 0.0, 0.25)), true((3.0, OFFSET, 0.0, 0.0))
    errors = ErrorDraws(scenario, 0, "sample")(num)
    errors.people[..., 2:] = 0.0  # a velocity's error would bend the closed form
    predicted = share_of_pairs(around_truth(base, state, errors), (1.0, 0.0), scenario.robot.limits)
    # Of a two-sample U-statistic the variance is at most p (1 - p) (1/N + 1/M).
    risk = passing_risk(np.sqrt(2.0) * STD)
    assert predicted == pytest.approx(risk, abs=4.0 * np.sqrt(risk * (1.0 - risk) * 2.0 / num))
