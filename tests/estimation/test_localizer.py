import numpy as np
import pytest

from mjnav.estimation.localizer import ParticleLocalizer
from mjnav.geometry.angles import wrap
from mjnav.noise import make_distribution, profile

SETTLED = 20  # readings after which the start is forgotten


def track(localizer, readings, truth):
    """Beliefs, and errors (T, 3) of their means."""
    beliefs = [localizer.update(reading) for reading in readings]
    errors = np.array([belief.mean for belief in beliefs]) - truth
    errors[:, 2] = wrap(errors[:, 2])
    return beliefs, errors


@pytest.mark.parametrize("name", ["pearson", "gaussian"])
def test_the_error_falls_well_below_the_sensors(drive, name):
    noise = dict(profile(name))
    errors = np.concatenate(
        [track(ParticleLocalizer(noise, 500, seed), *drive(noise, seed, ticks=200))[1][SETTLED:] for seed in range(4)]
    )
    rmse = np.sqrt(np.mean(errors**2, axis=0))
    assert rmse[0] < 0.35 * noise["pose.x"].std
    assert rmse[1] < 0.35 * noise["pose.y"].std
    assert rmse[2] < 0.5 * noise["pose.theta"].std


def test_the_belief_is_consistent_under_skewed_noise(drive, pearson):
    nees = []
    for seed in range(8):
        beliefs, errors = track(ParticleLocalizer(pearson, 500, seed), *drive(pearson, seed, ticks=150))
        nees += [e @ np.linalg.solve(b.covariance, e) for b, e in zip(beliefs, errors, strict=True)][SETTLED:]
    assert 2.0 < np.mean(nees) < 4.5  # 3 for an exact Gaussian posterior
    assert np.mean(np.array(nees) < 7.815) > 0.88  # the 95 % region of three degrees of freedom


def test_only_the_right_sign_of_the_noise_leaves_the_pose_unbiased(drive, mirrored, pearson):
    noise = pearson | {"pose.x": make_distribution("pearson", mean=0.0, std=0.08, skew=1.6, kurtosis=7.0)}
    reflected = noise | {"pose.x": mirrored(noise["pose.x"])}

    def errors_x(believed):
        runs = [track(ParticleLocalizer(believed, 300, s), *drive(noise, s, 120, v=0.0)) for s in range(8)]
        return np.array([errors[SETTLED:, 0].mean() for _, errors in runs])

    right, wrong = errors_x(noise), errors_x(reflected)
    assert abs(right.mean()) < 0.012
    assert abs(wrong.mean()) > 0.025
    assert np.sqrt(np.mean(wrong**2)) > 3.0 * np.sqrt(np.mean(right**2))


def test_odometry_noise_is_subtracted(drive, pearson):
    biased = pearson | {"odometry.v": make_distribution("gaussian", mean=0.3, std=0.01)}
    _, errors = track(ParticleLocalizer(biased, 500, 0), *drive(biased, 0, ticks=200, omega=0.0))
    assert abs(errors[SETTLED:, 0].mean()) < 0.02  # added, the robot would run 6 cm ahead at every reading


def test_a_heading_that_crosses_pi_is_followed(drive, pearson):
    readings, truth = drive(pearson, 1, ticks=200, v=0.3, omega=0.5, start=(0.0, 0.0, 3.0))
    assert np.abs(np.diff(truth[:, 2])).max() > 6.0
    beliefs, errors = track(ParticleLocalizer(pearson, 500, 1), readings, truth)
    assert np.abs(errors[SETTLED:, 2]).max() < 0.1
    assert max(belief.covariance[2, 2] for belief in beliefs[SETTLED:]) < 0.05**2
    assert all(np.all(np.abs(belief.particles[:, 2]) <= np.pi) for belief in beliefs)


def test_a_robot_carried_away_is_found_after_the_patience_and_once(drive, pearson):
    readings, _ = drive(pearson, 2, ticks=60)
    there, truth = drive(pearson, 3, ticks=60, start=(4.0, -3.0, 2.0))
    localizer = ParticleLocalizer(pearson, 500, 2)
    for reading in readings:
        assert not localizer.update(reading).recovered
    beliefs, errors = track(localizer, there[1:], truth[1:])
    assert [belief.recovered for belief in beliefs] == [False, False, True] + [False] * 56
    assert np.abs(errors[SETTLED:, :2]).max() < 0.08


def test_one_outlier_neither_moves_the_belief_nor_spreads_it_again(drive, pearson):
    readings, truth = drive(pearson, 4, ticks=60)
    readings[50].pose[:] += [3.0, -3.0, 2.0]
    beliefs, errors = track(ParticleLocalizer(pearson, 500, 4), readings, truth)
    assert not any(belief.recovered for belief in beliefs)
    assert np.abs(errors[50:, :2]).max() < 0.08


def test_a_belief_stays_as_it_was_handed_over(drive, pearson):
    readings, _ = drive(pearson, 6, ticks=30)
    localizer = ParticleLocalizer(pearson, 200, 6)
    beliefs = [localizer.update(reading) for reading in readings[:10]]
    copies = [(b.particles.copy(), b.weights.copy(), b.mean.copy()) for b in beliefs]
    for reading in readings[10:]:
        localizer.update(reading)
    for belief, copy in zip(beliefs, copies, strict=True):
        for now, then in zip((belief.particles, belief.weights, belief.mean), copy, strict=True):
            assert np.array_equal(now, then)


def test_the_first_belief_is_the_reading_less_its_noise(drive, pearson):
    readings, _ = drive(pearson, 7, ticks=1)
    belief = ParticleLocalizer(pearson, 20_000, 7).update(readings[0])
    offset = readings[0].pose - belief.particles
    for column, channel in enumerate(("pose.x", "pose.y")):
        assert offset[:, column].std() == pytest.approx(pearson[channel].std, rel=0.05)
        assert np.mean(((offset[:, column] - offset[:, column].mean()) / offset[:, column].std()) ** 3) > 0.8
    assert belief.ess == pytest.approx(20_000)


def test_readings_without_noise_are_followed_exactly_enough_and_without_a_nan(drive):
    noise = dict(profile("none"))
    beliefs, errors = track(ParticleLocalizer(noise, 500, 8), *drive(noise, 8, ticks=100))
    assert np.abs(errors).max() < 1e-3
    assert all(np.isfinite(belief.covariance).all() and np.isfinite(belief.weights).all() for belief in beliefs)
    assert not any(belief.recovered for belief in beliefs)


def test_draws_follow_the_weights_and_have_no_order(drive, pearson):
    localizer = ParticleLocalizer(pearson, 500, 10)
    readings, _ = drive(pearson, 10, ticks=40)
    for reading in readings:
        belief = localizer.update(reading)
    drawn = np.array([localizer.draw(25) for _ in range(400)])
    assert drawn.shape == (400, 25, 3)
    std = np.sqrt(np.diagonal(belief.covariance))
    assert np.all(np.abs(drawn.mean(axis=(0, 1)) - belief.mean) < 0.05 * std)
    assert drawn.std(axis=(0, 1)) == pytest.approx(std, rel=0.05)
    by_place = np.abs(drawn.mean(axis=0) - belief.mean) / std  # (25, 3)
    assert by_place.max() < 5.0 / np.sqrt(400)  # every place in the order has the belief's mean


def test_drawing_does_not_disturb_the_filter(drive, pearson):
    readings, _ = drive(pearson, 11, ticks=20)
    quiet, asked = ParticleLocalizer(pearson, 100, 11), ParticleLocalizer(pearson, 100, 11)
    for reading in readings:
        expected, belief = quiet.update(reading), asked.update(reading)
        asked.draw(25)
        assert np.array_equal(expected.particles, belief.particles)
