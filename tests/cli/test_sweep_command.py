"""`mjnav sweep`: what it prints, where it puts results and what it refuses."""

import pytest

from mjnav.study.store import Store

STUDY = """
schema = 1
name = "two methods"
scenes = ["crossing1"]
seeds = { count = 6 }
[set]
physics.engine = "kinematic"
time_limit = 0.5
[[methods]]
controller = "rkhs"
[[methods]]
controller = "mean"
"""
FAILING = """
from mjnav.control.methods.rkhs import Rkhs


class Failing(Rkhs):
    def decide(self, observation):
        if observation.time > 0.2:
            raise ZeroDivisionError("half way")
        return super().decide(observation)
"""


@pytest.fixture
def sweep(mjnav, tmp_path):
    """Calls `mjnav sweep` on the study in one process."""
    (tmp_path / "two.toml").write_text(STUDY)
    return lambda *words, study="two.toml": mjnav("sweep", study, "--workers", 1, *words)


def test_it_says_what_it_runs_and_where_the_rows_are(sweep, tmp_path):
    said = sweep()
    assert (said.code, said.err) == (0, "")
    first, last = said.out.splitlines()
    assert first == "two methods: 2 cells under 6 seeds are 12 episodes"
    assert last.startswith("runs/out/two methods: 12 episodes, 12 of them in ")
    store = Store(tmp_path / "runs/out/two methods")
    assert len(store.done()) == 12
    assert store.study().startswith("# mjnav sweep two.toml ")
    assert store.study().endswith(STUDY)


def test_an_episode_that_breaks_is_counted_by_its_cause_and_can_be_retried(sweep, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "failing_controllers.py").write_text(FAILING)
    (tmp_path / "two.toml").write_text(STUDY.replace('"mean"', '"failing_controllers:Failing"'))
    said = sweep("--seeds", 2)
    assert (said.code, said.err) == (1, "")
    cause, retry = said.out.splitlines()[-2:]
    assert cause.startswith("  2 failed: ")
    assert "ZeroDivisionError: half way" in cause
    assert retry == "  --retry-failed runs them again"
    assert "4 episodes, 0 of them" in sweep("--seeds", 2, "--resume").out
    assert "4 episodes, 2 of them" in sweep("--seeds", 2, "--retry-failed").out


def test_a_detour_that_is_asked_for_later_is_told_as_a_change(sweep, tmp_path):
    assert sweep("--seeds", 1).code == 0
    (tmp_path / "two.toml").write_text(STUDY.replace("[set]", "detour = true\n[set]"))
    said = sweep("--seeds", 2, "--resume")
    assert (said.code, "made: detour was false, is true (2 rows). Nothing was written" in said.err) == (2, True)
    assert sweep("--seeds", 2, "--resume", "--accept-changed").code == 0
    assert sweep("--seeds", 3, "--resume").code == 0
