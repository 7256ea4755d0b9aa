"""Tunes methods by the rules that runs/bench/tuning.toml states: for every method as many settings and episodes.

    python benchmarks/tune.py METHOD ... [-o FOLDER] [--workers N]

The worlds are those of the suites of `mjnav bench`, with training layouts and seeds that no suite has. The best
settings of each round go on to the next, with more episodes; the best of the last replaces the parameters as they stand
where it does better on layouts that no round had. Prints every round's ranking, and what replaces them as a line of a
study file. It resumes: rows lie in FOLDER/METHOD, and a run that was stopped goes on from there.

The parameters as they stand are a method's defaults, and so are those that its search does not draw. What this found
has become the defaults: a search of today starts from there, and does not repeat the one that found them.
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, sqrt
from os import cpu_count
from pathlib import Path
from statistics import fmean
from typing import Annotated, Any

from mjnav.control.registry import tuned
from mjnav.errors import unknown_name
from mjnav.loop.prepare import load_scenario
from mjnav.scene.library import data_folder
from mjnav.scene.load import read_text
from mjnav.scene.toml import parse, value_text
from mjnav.settings import Length, Range, Settled, read_document
from mjnav.study.bench import Bench, Suite
from mjnav.study.cells import resolve
from mjnav.study.compare.ranking import RULE, RankedSetting, rank
from mjnav.study.store import Store
from mjnav.study.study_file import MethodEntry, StudyFile, flat
from mjnav.study.sweep.schedulers import Scheduler, local
from mjnav.study.sweep.sweep import sweep, trials

FILE = data_folder("runs") / "bench" / "tuning.toml"
FIRST = 100_000  # seeds from here on
ROUNDS = ((24, 2), (6, 10), (2, 30))  # how many settings have run this many episodes of every suite
KEPT_BACK = 60  # episodes of every suite behind those, for the last comparison
Settings = Mapping[str, Mapping[str, Any]]  # values of parameters, by label


@dataclass(frozen=True, slots=True)
class Searches(Settled):
    """FILE."""

    schema: Annotated[int, Range(1, 1), "version of this format"]
    methods: Annotated[tuple[MethodEntry, ...], Length(1, 100), "each with a search"]


@dataclass(frozen=True, slots=True)
class Result:
    """How a setting did in every suite."""

    suites: Sequence[RankedSetting]

    @property
    def score(self) -> float:
        """The mean of the suites' means."""
        return fmean(suite.score.value for suite in self.suites)

    def gain(self, before: "Result") -> tuple[float, float]:
        """How much higher the score is than another's in the same episodes, and half the width of its 95 % interval."""
        pairs = [one.scores - other.scores for one, other in zip(self.suites, before.suites, strict=True)]
        error = sqrt(sum(pair.var(ddof=1) / len(pair) for pair in pairs)) / len(pairs)
        return fmean(pair.mean() for pair in pairs), 1.96 * error

    def __str__(self) -> str:
        success, touched = (fmean(s.figures[name].value for s in self.suites) for name in ("success", "collision"))
        episodes = sum(suite.episodes for suite in self.suites)
        return f"n {episodes:4}  score {self.score:.3f}  success {success:.0%}  collision {touched:.0%}"


def searches() -> dict[str, MethodEntry]:
    """The methods of FILE by name."""
    found = read_document(Searches, parse(read_text(str(FILE)), str(FILE)))
    return {method.identifier: method for method in found.methods}


def settings_of(method: MethodEntry) -> Settings:
    """Its parameters as they stand, "#1", and those that its search draws."""
    assert method.search is not None
    drawn = method.search.settings("tuning", method.identifier, method.controller, method.values)
    values = ({key.removeprefix("control."): value for key, value in one.items()} for one in drawn)
    return {f"#{number}": one for number, one in enumerate(values, 1)}


def training(suite: Suite, method: MethodEntry, settings: Settings) -> StudyFile:
    """The suite's worlds with training layouts, and these settings of the method.

    Weights of a change are drawn as at 10 Hz and follow the control period, as those of a preset do.
    """
    period = 1.0 / load_scenario(suite.scenes[0]).control.rate
    presets = {label: {**method.set, **tuned(**values)(period)} for label, values in settings.items()}
    study = suite.study([MethodEntry(method.controller, label, preset) for label, preset in presets.items()])
    return replace(study, name=f"tuning {suite.name}", set={**flat(study.set), "layout.purpose": "training"})


def run(studies: Sequence[StudyFile], count: range, store: Store, scheduler: Scheduler) -> dict[str, Result]:
    """Of all settings by their episodes in `count` of every suite, after running those that lack; the best first."""
    seeded, wanted = [], []
    for study in studies:
        cells = resolve(study)
        worlds = len(cells) // len(study.methods)
        seeds = range(FIRST + ceil(count.start / worlds), FIRST + ceil(count.stop / worlds))
        seeded.append(replace(study, seeds=tuple(seeds)))
        wanted += trials(seeded[-1], cells)
    if sweep(wanted, store, scheduler, text="# mjnav sweep tuning\n", resume=True).interrupted:
        raise SystemExit("interrupted: the same command goes on")
    by_suite = [{one.method: one.settings[0] for one in rank(store, study)} for study in seeded]
    results = {label: Result([ranked[label] for ranked in by_suite]) for label in by_suite[0]}
    return dict(sorted(results.items(), key=lambda item: -item[1].score))


def shown(results: Mapping[str, Result]) -> str:
    """The best of them, a line each."""
    return "".join(f"\n  {label:4} {result}" for label, result in list(results.items())[:6])


def tune(suites: Sequence[Suite], method: MethodEntry, folder: Path, scheduler: Scheduler) -> None:
    """All rounds with one method."""
    settings = settings_of(method)
    standing, *_ = labels = list(settings)

    def results_of(labels: Sequence[str], count: range, store: str) -> dict[str, Result]:
        own = {label: settings[label] for label in labels}
        return run([training(suite, method, own) for suite in suites], count, Store(folder / store), scheduler)

    for many, episodes in ROUNDS:
        results = results_of(labels[:many], range(episodes), "rounds")
        labels = list(results)
        print(f"{episodes} episodes of every suite:{shown(results)}", flush=True)
    best, last = labels[0], ROUNDS[-1][1]
    if best != standing:
        results = results_of((standing, best), range(last, last + KEPT_BACK), "kept-back")
        gain, half = results[best].gain(results[standing])
        print(f"layouts that no round had:{shown(results)}\n  {best} - {standing}: {gain:+.3f} ± {half:.3f}")
        if gain > 0.0:
            print(f"better: {value_text(settings[best])}", flush=True)
            return
    print("the parameters as they stand stay", flush=True)


def main() -> None:
    """Tunes the methods that are named, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("methods", nargs="+", metavar="METHOD")
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/out/tuning"))
    parser.add_argument("--workers", type=int, default=cpu_count() or 1)
    options = parser.parse_args()
    known = searches()
    for name in options.methods:
        if name not in known:
            parser.error(str(unknown_name("METHOD", name, known)))
    print(f"{RULE} of a suite; a setting's score is the mean over the suites")
    for name in options.methods:
        print(f"\n{name}", flush=True)
        tune(Bench.load().suites, known[name], options.output / name, local(options.workers))


if __name__ == "__main__":
    main()
