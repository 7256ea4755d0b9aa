"""--rank: the settings of every method of a study, the best first."""

import argparse
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from math import isfinite
from typing import Any

from mjnav.cli.terminal.tables import print_table
from mjnav.errors import InputError
from mjnav.study.cells import Labels
from mjnav.study.compare.ranking import RULE, MethodRanking, RankedSetting, rank
from mjnav.study.compare.result_tables import percent
from mjnav.study.store.store import Store
from mjnav.study.study_file import StudyFile

HEADS = ("", "n", "score", "success %", "collision %", "time [s]", "control cost", "values")
# options of tables that a ranking has not
OTHERS = ("after", "reference", "figure", "pool", "pool_all", "rivals", "win_by", "ratios", "output", "require")


def configure(parser: argparse.ArgumentParser) -> None:
    """--rank."""
    parser.add_argument(
        "--rank",
        action="store_true",
        help="in place of tables: the settings of each method by their score, and the best as a line of a study file",
    )


def check(arguments: argparse.Namespace) -> None:
    """Raises InputError for an option that does nothing beside --rank."""
    for name in OTHERS:
        if getattr(arguments, name):
            option = "AFTER" if name == "after" else f"--{name.replace('_', '-')}"
            raise InputError(f"{option} is for tables; --rank prints the settings of one study")


def write(store: Store, study: StudyFile | None, *, as_json: bool) -> None:
    """Prints the ranking. Raises InputError."""
    found = rank(store, study)
    if as_json:
        print(json.dumps({"schema": 1, "rule": RULE, "methods": [_document(one) for one in found]}))
        return
    labels = Labels.of(study).methods
    for one in found:
        rows = [(labels.get(setting.label, setting.label), *_row(setting)) for setting in one.settings]
        print_table(rows, (one.shown, *HEADS[1:]), numbers=range(1, 7))
        if one.settings:
            print(f"best: {one.settings[0].toml}")
        if one.num_missing:
            print(f"{one.num_missing} episodes are missing: the order is not final")
        print()
    print(RULE)


def _row(setting: RankedSetting) -> tuple[str, ...]:
    figures, failed = setting.figures, f" ({setting.num_failed} failed)" if setting.num_failed else ""
    return (
        f"{setting.num}{failed}",
        f"{setting.score.value:.3f}{_interval(setting)}",
        percent(figures["success"]),
        percent(figures["collision"]),
        *(f"{figures[name].value:.1f}" if figures[name].num else "-" for name in ("time_s", "control_cost")),
        ", ".join(f"{key} = {value}" for key, value in setting.values.items()) or "as they stand",
    )


def _interval(setting: RankedSetting) -> str:
    interval = setting.score.interval
    return "" if interval is None else f" [{interval[0]:.3f}, {interval[1]:.3f}]"


def _document(ranking: MethodRanking) -> Mapping[str, Any]:
    return {
        "method": ranking.method,
        "controller": ranking.controller,
        "missing": ranking.num_missing,
        "settings": [dict(_setting(one)) for one in ranking.settings],
    }


def _setting(setting: RankedSetting) -> Iterator[tuple[str, Any]]:
    yield from {"label": setting.label, "values": setting.values, "toml": setting.toml}.items()
    yield from {"episodes": setting.num, "failed": setting.num_failed, "score": asdict(setting.score)}.items()
    for name, one in setting.figures.items():
        yield name, {**asdict(one), "value": one.value if isfinite(one.value) else None}
