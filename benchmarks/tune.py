"""Tunes methods by the rules that the study `tuning` states: for every method as many settings and episodes.

    python benchmarks/tune.py METHOD ... [-o FOLDER] [--workers N]

The best settings of each round go on to the next, on more seeds; the best of the last is set beside the parameters as
they stand on layouts that no round had. Prints every round's ranking, as `mjnav compare --rank` does, and the better
one as a line of a study file. It resumes: rows lie in FOLDER/METHOD, and a run that was stopped goes on from there.

The parameters as they stand are a method's defaults, and so are those that its search does not draw. What this found
has become the defaults: a search of today starts from there, and does not repeat the one that found them.
"""

import argparse
from dataclasses import replace
from os import cpu_count
from pathlib import Path

from mjnav.study.cells import Cell, resolve
from mjnav.study.compare.ranking import RULE, RankedSetting, rank
from mjnav.study.store import Store
from mjnav.study.study_file import StudyFile, load_study, study_text
from mjnav.study.sweep.schedulers import Scheduler, local
from mjnav.study.sweep.sweep import sweep
from mjnav.study.trial import Trial

FIRST = 1000
ROUNDS = ((24, 3), (6, 11), (2, 31))  # how many settings are run, under the first so many seeds
KEPT_BACK = {"crowdnav-plus": 60}  # seeds behind those, for the last comparison, by scene
KEPT_BACK_ELSE = 14


def run(study: StudyFile, cells: list[Cell], seeds: dict[str, range], folder: Path, scheduler: Scheduler) -> None:
    """Adds the episodes of these cells under the `seeds` of their scenes to the rows in a folder."""
    most = max(len(some) for some in seeds.values())
    wanted = [Trial(study.name, c, seeds[c.scene][i]) for i in range(most) for c in cells if i < len(seeds[c.scene])]
    sweep(wanted, Store(folder), scheduler, text=f"# mjnav sweep tuning\n{study_text(study)}", resume=True)


def told(setting: RankedSetting) -> str:
    """A setting and how it did, in a line."""
    score, rates = setting.score, setting.figures
    shown = f"score {score.value:.3f} [{score.interval[0]:.3f}, {score.interval[1]:.3f}]"
    reached, touched = (100.0 * rates[name].value for name in ("success", "collision"))
    return f"{setting.label:28} n {setting.episodes:4}  {shown}  success {reached:.0f} %  collision {touched:.0f} %"


def tune(study: StudyFile, folder: Path, scheduler: Scheduler) -> None:
    """All rounds of a study with one method."""
    cells = list(resolve(study))
    standing = cells[0].method
    settings = list(dict.fromkeys(cell.method for cell in cells))
    scenes = {cell.scene for cell in cells}
    for count, num in ROUNDS:
        settings = settings[:count]
        own = [cell for cell in cells if cell.method in settings]
        run(study, own, dict.fromkeys(scenes, range(FIRST, FIRST + num)), folder / "rounds", scheduler)
        ranking = {setting.label: setting for setting in rank(Store(folder / "rounds"), study)[0].settings}
        settings = [label for label in ranking if label in settings]
        print(f"{num} seeds:", *(told(ranking[label]) for label in settings[:6]), sep="\n  ", flush=True)
    best = settings[0]
    if best != standing:
        last = FIRST + ROUNDS[-1][1]
        seeds = {scene: range(last, last + KEPT_BACK.get(scene, KEPT_BACK_ELSE)) for scene in scenes}
        run(study, [c for c in cells if c.method in (best, standing)], seeds, folder / "kept-back", scheduler)
        ranked = rank(Store(folder / "kept-back"), study)[0].settings
        print("layouts that no round had:", *map(told, ranked), sep="\n  ")
        best = ranked[0].label
    print(f"better: {best}\n  {ranking[best].toml if best != standing else 'the parameters as they stand'}", flush=True)


def main() -> None:
    """Tunes the methods that are named, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("methods", nargs="+", metavar="METHOD")
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/out/tuning"))
    parser.add_argument("--workers", type=int, default=cpu_count() or 1)
    options = parser.parse_args()
    study = load_study("tuning")
    print(RULE)
    for method in options.methods:
        own = replace(study, methods=tuple(m for m in study.methods if m.identifier == method))
        print(f"\n{method}", flush=True)
        tune(own, options.output / method, local(options.workers))


if __name__ == "__main__":
    main()
