"""Claims judged from rows that were made so that the answer is known."""

import numpy as np
import pytest

from mjnav.paper import degree, factors, kld, lane, many, one, pareto, shape, table
from mjnav.paper.contrast import Contrast, claim, contrasts, short, shown
from mjnav.paper.finding import Claim, Measured, Verdict, judge, overall
from mjnav.study.compare.compare import COLLISIONS, CellRows, Difference, Estimate

SEEDS = np.arange(40)
FIGURES = (
    "control_cost",
    "mean_deviation_m",
    "max_deviation_m",
    "path_ratio",
    "time_to_avoid_s",
    "min_clearance_m",
    "mean_safe_share",
    "mean_lane_clearance_m",
    "min_lane_clearance_m",
    "compute_ms_control_p50",
)
NOISE = np.random.default_rng(0).normal(scale=0.05, size=40)


def cell(method, *, scene="crossing1", setting="direct, physics.engine=kinematic noise.profile=pearson", **columns):
    """A cell of 40 seeds; figures not given are 1, seed by seed a little different."""
    figures = dict.fromkeys(FIGURES, 1.0 + NOISE)
    counts = dict.fromkeys((*COLLISIONS, "ticks_without_nominal", "ticks_without_own"), np.zeros(40))
    given = {name: np.broadcast_to(np.asarray(value, float), 40) for name, value in columns.items()}
    base = {"seed": SEEDS, "success": np.ones(40), "ticks": np.full(40, 100.0), "infeasible_ticks": np.zeros(40)}
    return CellRows(scene, setting, method, {**base, **figures, **counts, **given})


def verdicts(findings):
    return {finding.claim: finding.verdict for finding in findings}


def test_a_claim_about_all_settings_holds_in_all_of_them_or_in_some():
    holds, fails, open_ = Verdict.HOLDS, Verdict.FAILS, Verdict.OPEN
    assert overall([holds, holds]) == Verdict.HOLDS
    assert overall([holds, open_]) == Verdict.PARTLY
    assert overall([holds, open_, fails]) == Verdict.MIXED
    assert overall([fails, open_]) == Verdict.FAILS
    assert overall([open_]) == overall([]) == Verdict.OPEN


@pytest.mark.parametrize(
    ("value", "p", "num", "expected"),
    [
        (0.15, 0.01, 40, Verdict.HOLDS),
        (-0.15, 0.01, 40, Verdict.FAILS),
        (0.15, 0.05, 40, Verdict.OPEN),
        (0.15, 0.01, 19, Verdict.OPEN),  # too few seeds to judge by
        (np.nan, None, 0, Verdict.OPEN),
    ],
)
def test_a_sign_is_judged_by_its_p_value(value, p, num, expected):
    contrast = Contrast("here", Difference(Estimate(value, None, num), p))
    swapped = {Verdict.HOLDS: Verdict.FAILS, Verdict.FAILS: Verdict.HOLDS}
    for sign, wanted in ((+1, expected), (-1, swapped.get(expected, expected))):
        (found,) = judge([Claim("it is", "figure 1", [contrast.measured(sign)])])
        assert found.verdict == wanted


def test_the_tests_of_an_item_are_corrected_together_for_their_number():
    # 0.012 x 4, 0.02 x 3, 0.6 x 2: the first alone is left; 0.02 would have decided the second claim alone.
    tests = [Measured(True, 0.012), Measured(True, 0.02), Measured(False, 0.6), Measured(False, 0.9)]
    together = judge([Claim("first", "", tests[:1]), Claim("second", "", tests[1:3]), Claim("third", "", tests[3:])])
    assert [finding.verdict for finding in together] == [Verdict.HOLDS, Verdict.OPEN, Verdict.OPEN]
    (alone,) = judge([Claim("second", "", tests[1:3])])
    assert alone.verdict == Verdict.PARTLY


def test_a_difference_that_is_not_there_is_found_in_one_item_of_twenty_at_most():
    rng = np.random.default_rng(0)
    wrong = [
        {f.verdict for f in judge([Claim("it", "", [Measured(True, p) for p in rng.random(50)]) for _ in range(8)])}
        for _ in range(400)
    ]
    assert np.mean([found != {Verdict.OPEN} for found in wrong]) == pytest.approx(0.05, abs=0.03)


def test_contrasts_are_paired_by_setting_and_say_so():
    here, there = "direct, physics.engine=kinematic", "filtered, physics.engine=kinematic"
    cells = [cell("a", setting=here, control_cost=3.0 + NOISE), cell("b", setting=here, control_cost=1.0 + NOISE)]
    cells.append(cell("a", setting=there))
    found, alone = contrasts(cells, "a", "b", "control_cost")
    assert alone.measured(+1).line == "crossing1, filtered, kinematic: undefined (n = 0)"
    assert found.where == "crossing1, direct, kinematic"
    assert found.difference.estimate.value == pytest.approx(2.0)
    (judged,) = judge([claim("a is more", "figure 1", [found], +1, "m")])
    assert judged.verdict == Verdict.HOLDS
    assert judged.evidence.splitlines()[0] == "1 of 1 settings for it, 0 against"
    assert "+2 m [+2, +2] (n = 40); p = 0.0002" in judged.evidence
    assert shown(Estimate(np.nan, None, 0)) == "undefined (n = 0)"
    assert short("direct, physics.engine=mujoco noise.profile=bimodal") == "direct, mujoco bimodal"


def test_degree_and_lane_tell_one_weight_from_matched_weights():
    cells = [cell("d=1"), cell("d=2"), cell("d=3", min_clearance_m=1.5 + NOISE, mean_lane_clearance_m=1.5 + NOISE)]
    cells += [cell("d=2 matched"), cell("d=3 matched", mean_lane_clearance_m=0.5 + NOISE)]
    found = verdicts(degree.findings(cells))
    claim = "Degree 3 keeps a larger distance from the obstacle than degree 1, "
    assert found[f"{claim}at one weight"] == Verdict.HOLDS
    assert found[f"{claim}at matched weights of the mean's term"] == Verdict.OPEN
    found = verdicts(lane.findings(cells))
    claim = "Degree 3 stays farther from the lane's boundary than degree 1, "
    assert found[f"{claim}at one weight"] == Verdict.HOLDS
    assert found[f"{claim}at matched weights of the mean's term"] == Verdict.FAILS


def test_who_left_the_way_by_more_than_half_the_table_went_around():
    went = np.where(SEEDS < 35, 0.3, 1.2)
    lost = np.where(SEEDS < 10, 0.0, 1.0)
    cells = [cell("d=1", max_deviation_m=went), cell("d=3", max_deviation_m=1.5 - went)]
    cells.append(cell("d=1 matched", max_deviation_m=went, success=lost))
    first, matched, third = table.findings(cells)
    assert (first.verdict, third.verdict) == (Verdict.HOLDS, Verdict.HOLDS)
    assert "87.5 %" in first.evidence
    assert "of 30 runs, 10 more did not reach the goal unharmed" in matched.evidence


def test_one_obstacle_compares_three_measures_and_tells_infeasibility_over_eta():
    methods = [*one.RKHS, "gaussian-linearised"]
    cells = [cell(name, control_cost=(1.0 if name.startswith("rkhs") else 2.0) + NOISE) for name in methods]
    cells += [cell(one.moments(eta), ticks_without_own=20.0 * eta, control_cost=0.5 + NOISE) for eta in one.ETAS]
    found = verdicts(one.findings(cells))
    assert found["rkhs d=3 takes less control cost than gaussian-linearised"] == Verdict.HOLDS
    assert found[f"rkhs d=3 takes less control cost than {one.moments(one.TUNED_ETA)}"] == Verdict.FAILS
    assert found["A nominal control always exists"] == Verdict.HOLDS
    rising = [finding for finding in one.findings(cells) if "finds nothing" in finding.claim]
    assert rising[0].verdict == Verdict.HOLDS
    assert "0.5: 10.0 %" in rising[0].evidence
    assert "0.99: 19.8 %" in rising[0].evidence


def test_a_nominal_control_that_was_missing_once_did_not_always_exist():
    missing = np.where(SEEDS == 3, 2.0, 0.0)
    cells = [cell("rkhs d=1", ticks_without_nominal=missing)]
    (found,) = [finding for finding in one.findings(cells) if finding.source == "assumption 1"]
    assert found.verdict == Verdict.FAILS
    assert "97.5 %" in found.evidence
    assert "missing at 0.05 % of ticks" in found.evidence


def test_many_and_kld_look_at_their_own_scenes():
    cells = []
    for scene, cost in (("crossing1", 1.0), ("crossing2", 2.0), ("crossing3", 3.0)):
        cells += [cell("rkhs d=3", scene=scene), cell("gaussian-linearised", scene=scene, control_cost=cost + NOISE)]
        cells += [cell("rkhs d=1", scene=scene), cell("kld", scene=scene, compute_ms_control_p50=cost + NOISE)]
    found = verdicts(many.findings(cells))
    assert found["With 1 obstacle, rkhs d=3 takes less control cost than gaussian-linearised"] == Verdict.OPEN
    assert found["With 2 obstacles, rkhs d=3 takes less control cost than gaussian-linearised"] == Verdict.HOLDS
    (time,) = [f for f in kld.findings(cells) if f.claim == "rkhs d=1 takes less time to decide than kld"]
    assert time.evidence.startswith("1 of 2 settings for it")


def test_the_shape_is_judged_within_one_noise():
    cells = []
    for noise in ("pearson", "bimodal"):
        for samples, cost in (("true", 1.0), ("mirrored", 2.0), ("gaussian", 1.0)):
            cells.append(cell("saa", setting=f"{noise}, {samples}", control_cost=cost + NOISE))
    found = verdicts(shape.findings(cells))
    claim = "saa gives less control cost with samples of the noise's own shape than with "
    assert found[f"{claim}mirrored ones"] == Verdict.HOLDS
    assert found[f"{claim}gaussian ones"] == Verdict.OPEN


def test_a_factors_effect_is_the_mean_over_the_other_two():
    cells = []
    for chosen in factors.levels():
        saved = 1.0 * ("form=segment" in chosen) + 0.5 * ("prediction=true" in chosen)
        extra = 0.25 if {"form=segment", "preview=0.4"} <= set(chosen) else 0.0
        for engine in factors.ENGINES:
            setting = f"{engine}, {' '.join(chosen)}"
            cost = 5.0 - saved - extra + NOISE
            cells += [cell(name, setting=setting, control_cost=cost + i) for i, name in enumerate(factors.METHODS)]
    by_claim = {finding.claim: finding for finding in factors.findings(cells)}
    form = by_claim["The segment form of the cone in place of the line form saves control"]
    assert form.verdict == Verdict.HOLDS
    assert "rkhs, kinematic: -1.12 m²/s³" in form.evidence  # 1 and half of the interaction
    assert "-0.125" in by_claim["A preview of 0.4 s in place of one period saves control"].evidence
    assert "-0.5" in by_claim["Foreseeing the delay saves control"].evidence
    rival = by_claim["Matching distributions saves control, against mean, the factors being equal"]
    assert "kinematic: -2 m²/s³" in rival.evidence


def test_curves_are_read_off_at_equal_clearance():
    setting = "kinematic, direct, noise.profile=pearson"

    def curve(method, offset):
        return [
            cell(
                f"{method} x={x}",
                setting=setting,
                min_clearance_m=x + 0 * NOISE,
                control_cost=10.0 * x + offset + NOISE,
            )
            for x in (0.1, 0.3, 0.5)
        ]

    cells = [*curve("rkhs d=1", 0.0), *curve("saa", 2.0)]
    found = {finding.claim: finding for finding in pareto.findings(cells)}
    finding = found["At equal clearance, rkhs d=1 takes less control than saa"]
    assert finding.verdict == Verdict.HOLDS
    assert "kinematic, direct, pearson, at 0.30 m: -2 m²/s³ [-2, -2] (n = 40)" in finding.evidence


def test_curves_without_a_clearance_in_common_decide_nothing():
    setting = "kinematic, direct, noise.profile=pearson"
    cells = [cell(f"rkhs d=1 x={x}", setting=setting, min_clearance_m=x) for x in (0.1, 0.2)]
    cells += [cell(f"saa x={x}", setting=setting, min_clearance_m=x) for x in (0.3, 0.4)]
    found = {finding.claim: finding for finding in pareto.findings(cells)}
    finding = found["At equal clearance, rkhs d=1 takes less control than saa"]
    assert finding.verdict == Verdict.OPEN
    assert "no clearance in common" in finding.evidence
