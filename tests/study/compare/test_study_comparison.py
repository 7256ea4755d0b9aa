"""Tables of a sweep's rows, against figures worked out by hand from the same rows; and what is missing from a study."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.errors import InputError
from mjnav.metrics.intervals import wilson
from mjnav.study.compare.cell_rows import DEFAULT_FIGURES, cell_rows
from mjnav.study.compare.study_comparison import compare, compare_study
from mjnav.study.compare.worst_seeds import run_commands
from mjnav.study.store import COLUMNS, Store
from mjnav.study.study_file import MethodEntry, load_study
from tests.study.made_up import row

pyarrow = pytest.importorskip("pyarrow", reason="the sweep extra is not installed")

# ----------------------------------------------------------------------------------- tables of cells


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
    assert second.plain["infeasible_share"] == pytest.approx(1 / 40)
    assert second.plain["decision_ms"] == pytest.approx(np.median([3.0, 9.0, 3.5, 100.0]))


def test_a_ratio_is_of_the_means_over_common_successes():
    a = [row("a", 0, 1.0), row("a", 1, 4.0), row("a", 2, 50.0, hit=True)]
    b = [row("b", 0, 0.5), row("b", 1, 3.0), row("b", 2, 5.0), row("b", 3, 7.0)]
    (found,) = compared([*a, *b])
    ratio = found.rows[1].differences["control_cost"].ratio
    assert (ratio.value, ratio.num) == (pytest.approx(3.5 / 5.0), 2)
    assert ratio.interval == pytest.approx((0.5, 0.75))  # of either pair alone
    assert found.rows[1].differences["min_clearance_m"].ratio is None  # of which more is better
    assert found.rows[1].differences["success"].ratio is None
    for nothing in (0.0, 1e-16):
        (free,) = compared([row("a", 0, nothing), row("b", 0, 1.0)])
        assert free.rows[1].differences["control_cost"].ratio is None  # of a cost of nothing, or of rounding


def test_an_episode_without_a_result_counts_as_failed_and_in_nothing_else():
    rows = [row("a", seed, 1.0) for seed in range(3)]
    rows += [row("b", 0, 2.0), row("b", 1, 0.0, error="it broke"), row("b", 2, 2.0)]
    (found,) = compared(rows)
    b = found.rows[1]
    assert (b.num, b.num_failed) == (3, 1)
    assert (b.figures["success"].value, b.figures["success"].num) == (1.0, 2)
    assert b.differences["control_cost"].estimate.num == 2


# ------------------------------------------------------------------------------- figures of a table


@pytest.fixture
def ten_seeds(tmp_path):
    """Ten seeds: three hit a person, two of these by the robot's fault; one ran out of time."""
    store = Store(tmp_path)
    rows = []
    for seed in range(10):
        hit, late = seed < 3, seed == 5
        figures = {"robot_at_fault": 2 if seed < 2 else 0, "timeout": late, "min_human_distance_m": 0.1 * seed}
        figures |= {"people_see_robot": "none" if seed < 9 else "all", "stalled_s": float(seed)}
        if late:
            figures["success"] = False
        rows.append(row("rkhs", seed, 1.0 + seed, hit=hit, **figures))
    with store.writing(""):
        store.append(rows)
    return store


def test_a_truth_of_each_episode_is_a_rate_over_all_of_them(ten_seeds):
    (table,) = compare_study(ten_seeds, None, figures=["fault", "timeout", "min_human_distance_m", "stalled_s"]).tables
    found = table.rows[0].figures
    assert {name: (found[name].value, found[name].num) for name in ("success", "collision", "fault", "timeout")} == {
        "success": (0.6, 10), "collision": (0.3, 10), "fault": (0.2, 10), "timeout": (0.1, 10)
    }  # fmt: skip
    assert found["fault"].interval == wilson(2, 10)
    assert found["min_human_distance_m"].value == pytest.approx(0.45)  # over all
    assert found["stalled_s"].num == 6  # over those that succeeded
    assert table.people == ("all", "none")


def test_default_figures_that_no_row_has_are_left_out_and_those_asked_for_stay(ten_seeds):
    known = compare_study(ten_seeds, None, figures=DEFAULT_FIGURES).figures
    assert known == ("fault", "time_s", "control_cost", "min_clearance_m", "stalled_s", "min_human_distance_m")
    asked = compare_study(ten_seeds, None, figures=["path_ratio"])
    assert asked.figures == ("path_ratio",)
    assert np.isnan(asked.tables[0].rows[0].figures["path_ratio"].value)
    beside = compare_study(ten_seeds, None, figures=[*DEFAULT_FIGURES, "path_ratio"]).figures
    assert beside == (*known[:3], "path_ratio", *known[3:])


# -------------------------------------------------------------------------------- folders of results


STUDY = """
schema = 1
name = "made up"
scenes = ["crossing1", "mine/corner.toml"]
seeds = [3, 1, 7]
grid = { noise.profile = ["pearson", "bimodal"] }
[[methods]]
controller = "mean"
[[methods]]
controller = "rkhs"
grid = { weight = [1, 10.0] }
"""


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path / "results")
    with store.writing(""):
        pass
    return store


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "made up.toml"
    path.write_text(STUDY)
    return load_study(path)


def read(store, study=None, figures=("control_cost",), **options):
    return compare_study(store, study, figures=figures, **options)


def cell(method, seeds, setting="noise.profile=pearson", scene="crossing1", **columns):
    return [row(method, seed, 1.0 + seed, scene=scene, setting=setting, **columns) for seed in seeds]


def test_missing_seeds_are_counted_against_the_study_cell_by_cell(store, study):
    store.append([*cell("mean", [1, 3, 7]), *cell("rkhs weight=1", [3, 100]), *cell("rkhs weight=10.0", [3, 1])])
    found = read(store, study)
    assert [(row.method, row.num_missing) for _, row in found.rows] == [
        ("mean", 0), ("rkhs weight=1", 2), ("rkhs weight=10.0", 1)
    ]  # fmt: skip
    assert found.num_seeds == 3
    methods = ("mean", "rkhs weight=1", "rkhs weight=10.0")
    assert found.absent == tuple(("crossing1", "noise.profile=bimodal", method) for method in methods)
    assert (found.num_episodes, found.num_missing) == (7, 2 + 1 + 3 * 3)
    assert [r.method for r in found.tables[0].rows] == list(methods)


def test_scenes_of_the_sweeps_command_are_the_ones_that_count_and_can_be_run_again(store, study):
    with store.writing(f"# mjnav sweep 'made up.toml' --scene crossing2 --scene=crossing3\n{STUDY}"):
        store.append(cell("mean", [1, 3, 7], scene="crossing2"))
    found = read(store, study)
    assert {scene for scene, _, _ in found.absent} == {"crossing2", "crossing3"}
    assert found.num_missing == 3 * (2 * 2 * 3 - 1)
    command = run_commands(study, store)["crossing2", "noise.profile=pearson", "mean"]
    assert command == "mjnav run crossing2 --controller mean --set noise.profile=pearson"


def test_a_controller_in_a_file_is_run_again_by_its_path_wherever_the_study_lies(store, study):
    study = replace(study, methods=(MethodEntry("mine.py:Own"),))
    store.append(cell("mine.py:Own", [1], controller="/home/me/mine.py:Own"))
    commands = run_commands(study, store)
    assert commands["crossing1", "noise.profile=pearson", "mine.py:Own"].split()[4] == "/home/me/mine.py:Own"
    assert commands["crossing1", "noise.profile=bimodal", "mine.py:Own"].split()[4] == "mine.py:Own"  # without rows


def test_rows_of_another_study_are_left_out_and_told(store, study):
    store.append([*cell("mean", [1]), *cell("other", [1], study="another")])
    found = read(store, study)
    assert ([r.method for r in found.tables[0].rows], found.others) == (["mean"], ("another",))
    with pytest.raises(InputError, match="rows of several studies: another, made up"):
        read(store)


def test_a_seed_under_two_scenarios_is_refused(store):
    store.append(
        [*cell("mean", [1, 2, 3]), row("mean", 2, 9.0, scene="crossing1", setting="noise.profile=pearson", id="x")]
    )
    with pytest.raises(InputError, match="method mean has seed 2 under two scenarios"):
        read(store)


def test_pooled_scenes_pair_within_a_scene_and_count_every_layout(store, study):
    def episodes(scene, method, costs):
        return [row(method, seed, cost, scene=scene, setting="noise.profile=pearson") for seed, cost in costs.items()]

    store.append(
        [
            *episodes("crossing1", "mean", {1: 1.0, 3: 2.0, 7: 4.0}),
            *episodes("corner", "mean", {1: 10.0, 3: 20.0, 7: 40.0}),
            *episodes("crossing1", "rkhs weight=1", {1: 1.5, 3: 2.5}),
            *episodes("corner", "rkhs weight=1", {3: 23.0, 7: 44.0}),
        ]
    )
    found = read(store, study, pool=True)
    (table,) = found.tables
    assert (table.scene, table.num_layouts) == ("2 scenes", 2)
    mean, rkhs = table.rows
    assert (mean.num, mean.figures["control_cost"].value) == (6, pytest.approx(77.0 / 6.0))
    of_pairs = rkhs.differences["control_cost"].estimate
    assert (of_pairs.value, of_pairs.num) == (pytest.approx((0.5 + 0.5 + 3.0 + 4.0) / 4.0), 4)
    assert (mean.num_missing, rkhs.num_missing) == (0, 2)
    assert found.num_missing == read(store, study).num_missing == read(store, study, pool_all=True).num_missing


def test_settings_that_repeat_each_other_make_nothing_surer(store):
    rng = np.random.default_rng(0)
    of = {method: rng.gamma(4.0, size=30) for method in "ab"}
    for setting in ("one", "two"):
        store.append(
            [
                row(method, seed, float(cost), hit=seed % 7 == 0 and method == "a", setting=setting)
                for method, costs in of.items()
                for seed, cost in enumerate(costs)
            ]
        )
    one, two = read(store).tables
    (both,) = read(store, pool_all=True).tables
    assert (both.scene, both.setting) == ("s", "2 settings")
    for alone, twice in zip(one.rows, both.rows, strict=True):
        assert (twice.num, twice.num_units) == (2 * alone.num, alone.num_units)
        for figure, estimate in alone.figures.items():
            assert twice.figures[figure].value == pytest.approx(estimate.value)
            assert twice.figures[figure].interval == pytest.approx(estimate.interval, rel=1e-5)
    alone, twice = one.rows[1], both.rows[1]
    for figure, change in alone.differences.items():
        again = twice.differences[figure]
        assert again.estimate.interval == pytest.approx(change.estimate.interval, rel=1e-5)
        assert again.p == pytest.approx(change.p, abs=0.03)
    assert twice.wins.interval == pytest.approx(alone.wins.interval)
    assert two.rows[1].wins == alone.wins
