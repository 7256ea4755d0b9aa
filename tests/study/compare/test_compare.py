"""Tables of a sweep's rows, against figures worked out by hand from the same rows."""

import math

import numpy as np
import pytest

from mjnav.errors import InvalidValue
from mjnav.study.compare.cell_rows import cell_rows, natural
from mjnav.study.compare.compare import compare
from mjnav.study.store.row import COLUMNS
from tests.study.made_up import row

pyarrow = pytest.importorskip("pyarrow", reason="the sweep extra is not installed")


def table(rows):
    schema = pyarrow.schema([(name, pyarrow.type_for_alias(column.type)) for name, column in COLUMNS.items()])
    return pyarrow.Table.from_pylist([row.values() for row in rows], schema=schema)


def compared(rows, methods=("a", "b"), **options):
    return list(compare(cell_rows(table(rows), methods), **{"figures": ("control_cost", "min_clearance_m"), **options}))


def test_differences_are_of_common_successes_and_clearances_of_all():
    a = [row("a", seed, 1.0 + seed) for seed in range(4)]
    b = [row("b", 0, 3.0), row("b", 1, 9.0, hit=True), row("b", 2, 3.5), row("b", 7, 100.0)]
    (found,) = compared([*b, *a])
    assert found.reference == "a"
    first, second = found.rows
    assert (first.method, first.num, first.figures["control_cost"].value) == ("a", 4, 2.5)
    assert first.differences == {}
    assert second.figures["success"].value == 0.75
    assert second.figures["collision"].value == 0.25
    assert second.figures["control_cost"].value == pytest.approx((3.0 + 3.5 + 100.0) / 3)
    assert second.differences["control_cost"].estimate.value == pytest.approx((2.0 + 0.5) / 2)  # seeds 0 and 2
    assert second.differences["control_cost"].estimate.num == 2
    assert second.differences["min_clearance_m"].estimate.value == pytest.approx((2.0 - 2.01 + 0.5) / 3)
    assert second.differences["success"].estimate.value == pytest.approx(-1 / 3)
    assert second.infeasible_share == pytest.approx(1 / 40)
    assert second.decision_ms == pytest.approx(np.median([3.0, 9.0, 3.5, 100.0]))


def test_a_ratio_is_of_the_means_over_common_successes():
    a = [row("a", 0, 1.0), row("a", 1, 4.0), row("a", 2, 50.0, hit=True)]
    b = [row("b", 0, 0.5), row("b", 1, 3.0), row("b", 2, 5.0), row("b", 3, 7.0)]
    (found,) = compared([*a, *b])
    ratio = found.rows[1].differences["control_cost"].ratio
    assert (ratio.value, ratio.num) == (pytest.approx(3.5 / 5.0), 2)
    assert ratio.interval == pytest.approx((0.5, 0.75))  # of either pair alone
    assert found.rows[1].differences["min_clearance_m"].ratio is None  # of which more is better
    assert found.rows[1].differences["success"].ratio is None


def test_a_cost_of_nothing_has_no_ratio():
    (found,) = compared([row("a", 0, 0.0), row("a", 1, 1.0), row("b", 0, 1.0), row("b", 1, 1.0)])
    assert found.rows[1].differences["control_cost"].ratio is None


def test_an_episode_without_a_result_counts_as_failed_and_in_nothing_else():
    rows = [row("a", seed, 1.0) for seed in range(3)]
    rows += [row("b", 0, 2.0), row("b", 1, 0.0, error="it broke"), row("b", 2, 2.0)]
    (found,) = compared(rows)
    b = found.rows[1]
    assert (b.num, b.num_failed) == (3, 1)
    assert (b.figures["success"].value, b.figures["success"].num) == (1.0, 2)
    assert b.differences["control_cost"].estimate.num == 2


def test_p_values_are_corrected_over_the_methods():
    rng = np.random.default_rng(0)
    base = rng.normal(10.0, 1.0, size=30)
    rows = [row("a", seed, float(base[seed])) for seed in range(30)]
    for name, shift in (("b", 0.0), ("c", 0.0), ("d", 2.0)):
        rows += [row(name, seed, float(base[seed] + shift + rng.normal(scale=0.3))) for seed in range(30)]
    (found,) = compared(rows, methods=("a", "b", "c", "d"))
    p = {r.method: r.differences["control_cost"].p for r in found.rows if r.differences}
    assert p["d"] == pytest.approx(3 / 5001)  # the least that the flips can give, times three methods
    assert p["b"] > 0.05
    assert p["c"] > 0.05


def test_methods_come_in_the_order_of_the_study_and_their_values_as_numbers():
    names = ["rkhs weight=10.0", "mean", "rkhs weight=3.0", "rkhs d=3"]
    rows = [row(name, 0, 1.0) for name in names]
    (found,) = compared(rows, methods=("mean", "rkhs", "rkhs d=3"))
    assert [r.method for r in found.rows] == ["mean", "rkhs weight=3.0", "rkhs weight=10.0", "rkhs d=3"]
    assert natural("a 9") < natural("a 10.5") < natural("a 1e2")


def test_every_scene_has_a_table_and_one_without_the_reference_has_no_differences():
    rows = [row("a", 0, 1.0), row("b", 0, 2.0), row("b", 0, 2.0, scene="t")]
    one, other = compared(rows, reference="a")
    assert (one.scene, other.scene) == ("s", "t")
    assert one.rows[1].differences["control_cost"].estimate.value == 1.0
    assert (other.reference, other.rows[0].differences) == ("", {})


def test_what_nothing_defines_is_no_number():
    (found,) = compared([row("a", 0, 1.0, hit=True), row("b", 0, 1.0)])
    assert math.isnan(found.rows[0].figures["control_cost"].value)
    assert found.rows[0].figures["control_cost"].interval is None
    d = found.rows[1].differences["control_cost"]
    assert (d.estimate.num, d.p, d.estimate.interval) == (0, None, None)


def test_methods_with_other_seeds_are_compared_as_each_would_be_alone():
    rng = np.random.default_rng(1)
    rows = [row(name, seed, float(rng.gamma(3.0)), hit=seed % 7 == 3) for name in "abc" for seed in range(25)]
    rows = [r for r in rows if not (r.method == "c" and r.seed < 5)]
    (together,) = compared(rows, methods=tuple("abc"))
    for i, name in enumerate("bc", start=1):
        (alone,) = compared([r for r in rows if r.method in ("a", name)], methods=("a", name))
        for figure in ("success", "collision", "control_cost", "min_clearance_m"):
            d, own = together.rows[i].differences[figure].estimate, together.rows[i].figures[figure]
            assert d.value == alone.rows[1].differences[figure].estimate.value
            assert d.interval == pytest.approx(alone.rows[1].differences[figure].estimate.interval, rel=1e-6)
            assert own.interval == pytest.approx(alone.rows[1].figures[figure].interval, rel=1e-6)


def test_methods_without_a_common_seed_have_no_difference():
    (found,) = compared([row("a", 0, 1.0), row("b", 1, 2.0)])
    d = found.rows[1].differences["control_cost"]
    assert (d.estimate.num, d.estimate.interval, d.p) == (0, None, None)


@pytest.mark.parametrize("options", [{"reference": "aa"}, {"figures": ("control_costs",)}, {"figures": ("outcome",)}])
def test_unknown_methods_and_figures_are_refused(options):
    with pytest.raises(InvalidValue):
        compared([row("a", 0, 1.0)], **options)
