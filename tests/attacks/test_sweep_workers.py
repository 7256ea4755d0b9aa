"""Rows of a worker that is not as the process that began the sweep are not mixed with the others unasked."""

import importlib
import sys
from dataclasses import replace

import pytest

from mjnav.errors import MjnavError
from mjnav.study.cells import resolve
from mjnav.study.store import Store
from mjnav.study.study_file import load_study
from mjnav.study.sweep.sweep import sweep, trials
from mjnav.study.trial import Trial, run_trial
from tests.attacks.test_sweep_identity import FILES


@pytest.fixture
def own_trials(tmp_path, monkeypatch) -> list[Trial]:
    """The episodes of a study whose controller imports a file beside it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("own_controllers", "own_risk"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    importlib.invalidate_caches()
    for name, text in FILES.items():
        (tmp_path / name).write_text(text.replace("count = 2", "count = 3"))
    study = load_study("own.toml")
    return trials(study, resolve(study))


def elsewhere(wanted):
    """Rows as a worker with another NumPy would return them, except for the first."""
    for number, trial in enumerate(wanted):
        row = run_trial(trial)
        yield replace(row, machine="there", made_with={**row.made_with, "version.numpy": "1.0"}) if number else row


def test_rows_of_another_numpy_are_kept_on_request_alone(own_trials, tmp_path):
    store = Store(tmp_path / "out")
    with pytest.raises(MjnavError, match=r"^the worker on there differs from this process: numpy was .*, is 1\.0; "):
        sweep(own_trials, store, elsewhere)
    assert len(store.done()) == 1
    assert sweep(own_trials, store, elsewhere, resume=True, accept_changed=True).run == 2
    assert sweep(own_trials, store, elsewhere, resume=True, accept_changed=True).run == 0
