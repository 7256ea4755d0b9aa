"""Two folders of results: every seed that ended otherwise is named, and the figures are paired by seed."""

import json

import pytest

from mjnav.errors import InputError, InvalidValue, MjnavError
from mjnav.metrics.intervals import mcnemar
from mjnav.study.compare.before_after import before_after
from mjnav.study.results import compare
from mjnav.study.store import Store
from tests.study.made_up import row

pytest.importorskip("pyarrow", reason="the sweep extra is not installed")

NUM = 40


def end(outcome):
    """The columns of a row with this outcome."""
    success = outcome == "goal"
    return {
        "outcome": outcome,
        "success": success,
        "state_hash": outcome,
        "collisions_person": int(outcome == "collision"),
    }


@pytest.fixture
def folders(tmp_path):
    """Method a: seeds 0 to 7 go from goal to collision, 8 from collision to goal, 9 to another failure, 10 breaks.

    Method b is the same in both but in the last bit of seed 0; c stands before only, d after only.
    """

    def outcomes(after):
        found = dict.fromkeys(range(NUM), "goal")
        found |= dict.fromkeys(range(8), "collision") if after else {8: "collision"}
        return found | {9: "timeout" if after else "collision"}

    before, after = Store(tmp_path / "before"), Store(tmp_path / "after")
    for store in (before, after):
        late = store is after
        document = f"[noise]\nprofile = 'pearson'\nscale = {2.0 if late else 1.0}\n"
        facts = {"version.numpy": "2.5" if late else "2.4", "python": "3.11"}
        common = {"scenario": document, "made_with": facts, "control": json.dumps({"weight": 9 if late else 3})}
        with store.writing("# mjnav sweep\n"):
            of_a = [
                row("a", seed, 1.0 + late, **end(ended), **common, error="it broke" if late and seed == 10 else None)
                for seed, ended in outcomes(late).items()
            ]
            bits = [{"state_hash": f"bits {late and seed == 0}"} for seed in range(NUM)]
            of_b = [row("b", seed, 1.0, **end("goal") | hashed) for seed, hashed in enumerate(bits)]
            store.append([*of_a, *of_b, row("d" if late else "c", 0, 1.0, **end("goal"))])
    return before, after


def test_every_seed_that_ended_otherwise_is_named_with_both_outcomes(folders):
    a, b = before_after(*folders).cells
    assert (a.place[2], a.pairs, b.place[2], b.pairs, b.identical, b.seeds) == ("a", NUM, "b", NUM, NUM - 1, ())
    worse = [(seed.seed, seed.before, seed.after) for seed in a.seeds_of("worse")]
    assert worse == [*((n, "goal", "collision") for n in range(8)), (10, "goal", "failed")]
    assert [(seed.seed, seed.before, seed.after) for seed in a.seeds_of("better")] == [(8, "collision", "goal")]
    assert [(seed.seed, seed.before, seed.after) for seed in a.seeds_of("other")] == [(9, "collision", "timeout")]


def test_the_figures_are_paired_by_seed_and_corrected_for_the_number_of_cells(folders):
    a, b = before_after(*folders).cells
    success = a.after.differences["success"]
    assert success.estimate.num == NUM - 1  # seed 10 has no result
    assert success.estimate.value == pytest.approx((1 - 8) / (NUM - 1))
    assert success.p == pytest.approx(2 * mcnemar(1, 8))
    assert b.after.differences["success"].p == 1.0
    assert a.after.differences["control_cost"].estimate.value == 1.0
    assert a.before.figures["success"].num == NUM


def test_what_changed_is_named_with_both_values(folders):
    found = {change.what: (change.before, change.after, change.cells) for change in before_after(*folders).changed}
    assert found == {"noise.scale": ("1.0", "2.0", 1), "control.weight": ("3", "9", 1), "numpy": ("2.4", "2.5", 1)}


def test_folders_that_cannot_be_compared_are_refused_with_the_reason(folders, tmp_path):
    before, after = folders
    with pytest.raises(InputError, match="are the same folder"):
        before_after(before, Store(tmp_path / "after" / ".." / "before"))
    other = Store(tmp_path / "other")
    with other.writing("# mjnav sweep\n"):
        other.append([row("e", 0, 1.0, **end("goal")), row("c", 7, 1.0, **end("goal"))])
    with pytest.raises(InputError, match="no episode in common"):
        before_after(before, other)
    with pytest.raises(InvalidValue, match="did you mean 'control_cost'"):
        before_after(before, after, figures=["control_costs"])
    with pytest.raises(InputError, match="no results of a sweep"):
        compare(before.folder, tmp_path)
    shard = next(after.folder.glob("part-*.parquet"))
    shard.write_bytes(shard.read_bytes()[:-9])
    with pytest.raises(MjnavError, match=f"{shard}: damaged"):
        compare(before.folder, after.folder)
