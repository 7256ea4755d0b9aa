"""From a study to the logs that its sweep kept."""

import pytest

from mjnav.errors import InputError
from mjnav.study.avoidable import Source, sources
from mjnav.study.store import Store
from tests.study.made_up import row


def log(seed):
    return f"logs/s-default-a-{seed}-{seed:016x}.mcap"


def kept(folder, rows):
    Store(folder).append(rows)
    (folder / "logs").mkdir()
    for one in rows:
        if one.log is not None:
            (folder / one.log).touch()
    return folder


def test_a_studys_logs_come_by_method_setting_and_seed_with_its_names_of_methods(tmp_path):
    rows = [
        row("b", 10, 1.0, hit=True, log=log(1)),
        row("b", 2, 1.0, hit=True, log=log(2)),
        row("a", 2, 1.0, hit=True, log=log(3), setting="blind"),
        row("a", 2, 1.0, success=False, log=log(4)),
        row("a", 3, 1.0),
    ]
    folder = kept(tmp_path, rows)
    found, said = sources(str(folder))
    assert list(found) == [
        Source(folder / log(place), method)
        for place, method in ((3, "a, blind"), (4, "a"), (2, "b"), (1, "b"))
    ]  # fmt: skip
    assert said == (
        f"{folder}: logs of 4 of 5 episodes, every failure among them: shares are the study's, times at rest those of "
        "these runs alone"
    )
    assert sources(str(folder / "logs"))[0] == tuple(Source(folder / log(place)) for place in (1, 2, 3, 4))


def test_failures_without_logs_are_told_and_a_study_without_any_is_refused(tmp_path):
    folder = kept(tmp_path, [row("a", 1, 1.0, hit=True), row("a", 2, 1.0, hit=True, log=log(2)), row("a", 3, 1.0)])
    _, said = sources(str(folder))
    assert said == (
        f"{folder}: logs of 1 of 3 episodes; 1 of 2 failures have none: "
        "mjnav sweep STUDY --keep-logs failures keeps those of episodes that fail"
    )
    (folder / log(2)).unlink()
    with pytest.raises(InputError, match="kept no logs; mjnav sweep STUDY --keep-logs failures"):
        sources(str(folder))
