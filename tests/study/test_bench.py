"""The bench: its suites and reference rows, what is paired with what, what changes, and how methods are tuned."""

import importlib.util
import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as parquet
import pytest

from mjnav.control.registry import CHANGES
from mjnav.errors import InvalidValue, MjnavError
from mjnav.scene import loads
from mjnav.study.bench import Bench, Reference, comparison, share_of, weakest
from mjnav.study.cells import resolve
from mjnav.study.store import Store, schema
from mjnav.study.study_file import MethodEntry
from tests.study.made_up import row

pytest.importorskip("pyarrow", reason="the sweep extra is not installed")


@pytest.fixture(scope="module")
def bench():
    return Bench.load()


@pytest.fixture
def small(bench):
    """One suite of one scene."""
    return bench.only(["dsrnn"])


@pytest.fixture
def reference(bench, small, tmp_path):
    """Rows of two methods, seeds 0 to 29; orca touches somebody under the first six."""
    store = Store(tmp_path / "reference")
    rows = [
        row(method, seed, 1.0 + 0.01 * seed + i, hit=method == "orca" and seed < 6, scene="dsrnn", study="bench dsrnn")
        for i, method in enumerate(("rkhs-plan", "orca"))
        for seed in range(30)
    ]
    with store.writing(""):
        store.append(rows)
    return Reference.of(store, replace(small, methods=tuple(m for m in bench.methods if m.identifier in ("orca",))))


def own(tmp_path, seeds, scene="dsrnn", hit=()):
    store, place = Store(tmp_path / "own"), {"scene": scene, "study": "bench dsrnn", "controller": "mine.py:Own"}
    with store.writing(""):
        store.append([row("mine.py:Own", s, 0.5 + 0.01 * s, hit=s in hit, **place) for s in seeds])
    return store


def test_shipped_rows_are_of_the_suites_as_they_are(bench):
    """Whoever changes a suite raises its version, and makes the reference anew."""
    shipped = Reference.load(bench.rows)
    assert {suite.name: shipped.differs(suite) for suite in bench.suites} == {s.name: None for s in bench.suites}
    assert len(shipped.content()) < 3_000_000
    assert shipped.made["parameters"] == bench.parameters, "a method's defaults have changed"
    for suite in bench.suites:
        rows = shipped.rows(suite.study(bench.methods).name)
        seeds = set(shipped.seeds(suite.study(bench.methods).name))
        per_method = Counter(
            method for method, seed in zip(rows["method"].to_pylist(), rows["seed"].to_pylist(), strict=True)
            if seed in seeds
        )  # fmt: skip
        assert seeds <= set(suite.study(bench.methods).all_seeds)
        assert set(per_method) == {method.identifier for method in bench.methods}
        assert len(set(per_method.values())) == 1, "every method has every episode"


def test_an_unfinished_run_has_done_the_same_share_of_every_suite(bench):
    two = bench.only(["rooms", "doors"])
    seeds = {suite.name: list(suite.study(bench.methods).all_seeds) for suite in two.suites}
    wanted = two.trials([bench.entry("mean", {})], seeds)
    assert Counter(trial.study for trial in wanted) == {"bench rooms": 400, "bench doors": 400}
    for done in (80, 200, 640):
        parts = Counter(trial.study for trial in wanted[:done])
        assert abs(parts["bench rooms"] - parts["bench doors"]) <= 1


def test_a_share_is_the_first_seeds_and_never_none():
    assert [list(share_of([3, 5, 8], share)) for share in (0.01, 1 / 3, 0.34, 1.0)] == [[3], [3], [3, 5], [3, 5, 8]]
    assert share_of([], 0.5) == []


def test_only_the_episodes_that_the_method_has_are_compared(small, reference, tmp_path):
    mine = small.entry("mine.py:Own", {})
    (table,) = comparison(small, reference, own(tmp_path, range(10), hit=(1,)), [mine]).tables
    assert [(one.label, one.num) for one in table.rows] == [("Own", 10), ("rkhs-plan", 10), ("orca", 10)]
    assert table.reference == "mine.py:Own"
    own_row, planner, orca = table.rows
    assert (own_row.figures["success"].value, orca.figures["success"].value) == (0.9, 0.4)
    assert planner.wins is not None
    assert (planner.wins.wins, planner.wins.losses) == (1, 9), "by the contact under seed 1; else by time"
    assert planner.differences["time_s"].ratio is not None


def test_without_a_method_the_reference_is_shown_whole(small, reference, tmp_path):
    (table,) = comparison(small, reference, Store(tmp_path / "none"), []).tables
    assert [(one.label, one.num) for one in table.rows] == [("rkhs-plan", 30), ("orca", 30)]


def test_an_episode_counts_once_beside_the_table_over_all_suites(bench, reference, tmp_path):
    both = bench.only(["dsrnn", "crowdnav"])
    results = comparison(both, reference, Store(tmp_path / "none"), [])
    assert [table.scene for table in results.tables] == ["all suites", "dsrnn"]
    assert results.num_episodes == 60


def test_rows_of_another_version_or_world_are_not_compared(small, reference, tmp_path):
    store, mine = own(tmp_path, range(10)), small.entry("mine.py:Own", {})
    (suite,) = small.suites
    for other, why in (
        (replace(suite, version=2), "version 1, this is 2"),
        (replace(suite, set={**suite.set, "time_limit": 31.0}), "other worlds"),
        (replace(suite, name="new"), "no reference rows"),
    ):
        assert why in (reference.differs(other) or "")
    (table,) = comparison(replace(small, suites=(replace(suite, version=2),)), reference, store, [mine]).tables
    assert [one.label for one in table.rows] == ["Own"]


def test_a_shipped_method_stands_beside_its_own_reference_rows(bench):
    chosen = replace(bench, methods=(MethodEntry("rkhs", set={"weight": 4.0, "horizon": 4.0}),))
    entry = chosen.entry("rkhs", {"weight": 3.0})
    assert entry.identifier == "rkhs (here)"
    assert entry.set == {"weight": 3.0, "horizon": 4.0}, "all else as in the reference"


def test_the_worst_episode_comes_with_the_command_that_repeats_it(small, tmp_path):
    mine = small.entry("mine.py:Own", {})
    ((suite, episode, command),) = weakest(small, own(tmp_path, range(10), hit=(4,)), mine)
    assert (suite, episode) == ("dsrnn", "dsrnn, seed 4: touched a person")
    assert command.startswith("mjnav run dsrnn --controller mine.py:Own")
    assert "--seed 4 --log dsrnn4.mcap" in command


def test_an_unknown_suite_a_wrong_file_and_broken_rows_are_named(bench, tmp_path):
    with pytest.raises(InvalidValue, match="dsrnn"):
        bench.only(["dsrn"])
    (tmp_path / "own.toml").write_text("schema = 1\nsuites = []\n")
    with pytest.raises(InvalidValue, match=r"own\.toml: suites: found"):
        Bench.load(str(tmp_path / "own.toml"))
    (tmp_path / "own.parquet").write_bytes(b"no Parquet")
    with pytest.raises(MjnavError, match=r"own\.parquet: cannot be read"):
        Reference.load(tmp_path / "own.parquet")
    parquet.write_table(schema().empty_table(), tmp_path / "bare.parquet")  # as another program leaves one: without
    with pytest.raises(MjnavError, match=r"bare\.parquet: cannot be read"):  # what the rows were made in
        Reference.load(tmp_path / "bare.parquet")


def test_every_method_but_the_equations_alone_is_tuned_on_layouts_that_no_suite_has(bench):
    spec = importlib.util.spec_from_file_location("tune", Path(__file__).parents[2] / "benchmarks" / "tune.py")
    tune = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tune)
    methods = tune.searches()
    assert {*methods} == {method.identifier for method in bench.methods} - {"rkhs-paper"}
    for i, method in enumerate(methods.values()):
        suite, drawn = bench.suites[i % len(bench.suites)], tune.settings_of(method)["#2"]
        assert max(suite.study(bench.methods).all_seeds) < tune.FIRST
        for cell in resolve(tune.training(suite, method, {"#2": drawn})):  # refuses what the method does not take
            assert 'purpose = "training"' in cell.document or "[published]" in cell.document
            for key in {*CHANGES} & {*drawn}:
                at_10_hz = drawn[key] * 10.0 / loads(cell.document).control.rate
                assert json.loads(cell.control)[key] == pytest.approx(at_10_hz)
