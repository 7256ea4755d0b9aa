"""What a folder of results says of a study: which rows are its, what is missing, what went wrong."""

import numpy as np
import pytest

from mjnav.errors import InputError, InvalidValue
from mjnav.study.compare.study_comparison import compare_study
from mjnav.study.store.store import Store
from mjnav.study.study_file import load_study
from tests.study.made_up import row

pytest.importorskip("pyarrow", reason="the sweep extra is not installed")

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
    place = ("crossing1", "noise.profile=pearson")
    assert found.missing == {(*place, "mean"): 0, (*place, "rkhs weight=1"): 2, (*place, "rkhs weight=10.0"): 1}
    assert found.num_seeds == 3
    methods = ("mean", "rkhs weight=1", "rkhs weight=10.0")
    assert found.absent == tuple(("crossing1", "noise.profile=bimodal", method) for method in methods)
    assert (found.num_episodes, found.num_missing) == (7, 2 + 1 + 3 * 3)
    assert [r.method for r in found.tables[0].rows] == list(methods)


def test_a_scene_given_by_path_is_asked_for_where_there_are_rows_of_it(store, study):
    store.append(cell("mean", [1], scene="corner"))
    found = read(store, study)
    assert ("corner", "noise.profile=bimodal", "mean") in found.absent
    assert {scene for scene, _, _ in found.absent} == {"crossing1", "corner"}


def test_without_a_study_nothing_is_missing(store):
    store.append(cell("mean", [1]))
    found = read(store)
    assert (found.num_seeds, found.num_missing, found.absent) == (None, 0, ())
    assert found.study == "made up"


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


def test_causes_and_revisions_are_those_of_the_rows(store):
    store.append([row("a", 0, 1.0), row("a", 1, 1.0, error="it broke"), row("b", 0, 1.0, error="it broke")])
    store.append([row("b", 2, 1.0, revision="2")])
    found = read(store)
    assert (found.causes, found.revisions) == ({"it broke": 2}, ("1", "2"))
    assert [(r.num, r.num_failed) for r in found.tables[0].rows] == [(2, 1), (2, 1)]


def test_figures_are_each_compared_once_and_rates_always(store):
    store.append(cell("mean", [1]))
    found = read(store, figures=("time_s", "success", "time_s", "collision"))
    assert found.figures == ("time_s",)
    assert list(found.tables[0].rows[0].figures) == ["success", "collision", "time_s"]


@pytest.mark.parametrize(
    ("options", "key", "nearest"),
    [
        ({"figures": ("control_costs",)}, "figure", "control_cost"),
        ({"figures": ("outcome",)}, "figure", None),
        ({"reference": "men"}, "reference", "mean"),
    ],
)
def test_unknown_names_are_refused_with_the_nearest(store, options, key, nearest):
    store.append(cell("mean", [1]))
    with pytest.raises(InvalidValue) as refused:
        read(store, **options)
    assert (refused.value.key, refused.value.nearest) == (key, nearest)


def test_an_empty_folder_is_refused(store):
    with pytest.raises(InputError, match="no results of a sweep"):
        read(store)


def test_its_repr_is_one_line_and_a_notebook_shows_a_row_for_each_method(store):
    store.append([*cell("a<b", range(4)), *cell("b", range(4))])
    found = read(store)
    assert repr(found) == f"StudyComparison({str(store.folder)!r}: 8 episodes, tables: 1)"
    assert found._repr_html_().count("<tr>") == 3
    assert "a&lt;b" in found._repr_html_()


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
    place = ("2 scenes", "noise.profile=pearson")
    assert {key: num for key, num in found.missing.items() if num} == {(*place, "rkhs weight=1"): 2}
    assert found.num_missing == read(store, study).num_missing


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


def test_a_layout_of_several_seeds_is_one_unit_and_a_failed_episode_its_own(store):
    for setting in ("one", "two"):
        rows = [row("a", seed, 1.0 + seed, setting=setting, layout=f"reporting {seed // 2}") for seed in range(6)]
        store.append([*rows, row("a", 6, 1.0, setting=setting, error="it broke")])
    (table,) = read(store, pool_all=True).tables
    assert (table.rows[0].num, table.rows[0].num_units, table.num_layouts) == (14, 4, 3)


def test_missing_episodes_are_counted_over_all_settings(store, study):
    store.append([*cell("mean", [1, 3, 7]), *cell("rkhs weight=1", [3]), *cell("rkhs weight=10.0", [3, 1])])
    store.append(cell("mean", [1], setting="noise.profile=bimodal"))
    found = read(store, study, pool_all=True)
    place = ("crossing1", "2 settings")
    assert found.missing == {(*place, "mean"): 2, (*place, "rkhs weight=1"): 2, (*place, "rkhs weight=10.0"): 1}
    assert found.num_missing == read(store, study).num_missing
