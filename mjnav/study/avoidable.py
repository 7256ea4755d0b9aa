"""Asks the oracle of each log of a study or folder whether its outcome was avoidable, and counts the answers by method.

`sources` finds the logs that a file, a folder of logs or a study stands for: of a study, those that its sweep kept.

`judge` asks the oracle about one log; `by_method` puts the methods beside one another.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mjnav.errors import InputError, InvalidValue
from mjnav.log.read.log import open_log
from mjnav.metrics.intervals import Interval, wilson
from mjnav.metrics.oracle.avoidable import LEADS, Judgement, judged
from mjnav.study.keep import kept_log
from mjnav.study.results import find_results
from mjnav.study.store.store import Store

DEFAULT_SETTING = "default"
_COLUMNS = ("scene", "setting", "method", "seed", "success", "error", "log")


@dataclass(frozen=True, slots=True)
class Source:
    """A log, and the name that its study gives the method; None of a log without a study."""

    path: Path
    method: str | None = None


@dataclass(frozen=True, slots=True)
class Kept:
    """How many logs a study kept."""

    folder: Path
    episodes: int
    failures: int  # episodes with a result that did not succeed
    logs: int
    failures_without_log: int

    def __str__(self) -> str:
        text = f"{self.folder}: logs of {self.logs} of {self.episodes} episodes"
        if self.failures_without_log:
            lacking = f"{self.failures_without_log} of {self.failures} failures have none"
            return f"{text}; {lacking}: mjnav sweep --keep-logs failures keeps them"
        if self.logs == self.episodes:
            return text
        return f"{text}, every failure among them: shares are the study's, times at rest those of these runs alone"


def sources(given: str) -> tuple[Sequence[Source], Kept | None]:
    """The logs that `given` names, and of a study how many it kept.

    A file is a log; a folder with logs stands for these; anything else is a study as `mjnav compare` takes it. Raises
    InputError where there is no log.
    """
    path = Path(given)
    if path.suffix == ".mcap" or (path.is_file() and path.suffix != ".toml"):
        return (Source(path),), None
    if path.is_dir() and (logs := sorted(path.glob("*.mcap"))):
        return tuple(map(Source, logs)), None
    if path.is_dir() and not any(path.glob("*.parquet")):
        raise InputError(f"{path}: a folder without logs (*.mcap) and without results of a sweep")
    try:
        return _of_study(find_results(given)[0])
    except InvalidValue as error:
        if error.key != "study":
            raise
        raise InvalidValue(
            "LOG", given, f"a log, a folder of logs, or {error.allowed}", nearest=error.nearest
        ) from None


def _of_study(store: Store) -> tuple[Sequence[Source], Kept]:
    found, failures, lacking = [], 0, 0
    rows = store.rows(_COLUMNS).to_pylist()
    for row in sorted(rows, key=lambda row: [row[name] for name in ("method", "setting", "scene", "seed")]):
        log = kept_log(store.folder, row["log"])
        failed = row["error"] is None and not row["success"]
        failures += failed
        lacking += failed and log is None
        if log is not None:
            setting = "" if row["setting"] == DEFAULT_SETTING else f", {row['setting']}"
            found.append(Source(log, f"{row['method']}{setting}"))
    if not found:
        raise InputError(
            f"{store.folder}: kept no logs; mjnav sweep STUDY --keep-logs failures keeps those of episodes that fail"
        )
    return tuple(found), Kept(store.folder, len(rows), failures, len(found), lacking)


@dataclass(frozen=True, slots=True)
class JudgedLog:
    """What the oracle says of one run."""

    path: Path
    scene: str
    method: str
    seed: int | None
    outcome: str | None  # None of a run that did not end
    judgement: Judgement


@dataclass(frozen=True, slots=True)
class Share:
    """How many of how many."""

    count: int
    of: int

    @classmethod
    def of_truths(cls, truths: Sequence[bool]) -> "Share":
        """How many are true."""
        return cls(sum(truths), len(truths))

    @property
    def interval(self) -> Interval:
        """Wilson's, 95 %; None of nothing."""
        return wilson(self.count, self.of)


@dataclass(frozen=True, slots=True)
class MethodShares:
    """The runs of one method, over all scenes."""

    runs: int
    at_fault: Share  # collisions with a person that were the robot's fault, of all collisions
    avoidable: tuple[Share, ...]  # collisions, at each of LEADS before
    timeouts: Share  # that could have been avoided, of all
    rest: float  # [s] at rest, mean over the runs
    rest_free: float  # [s] of it with a way free


def judge(source: Source) -> JudgedLog:
    """Opens a log and asks the oracle. Raises what `open_log` and `Log.trajectory` raise."""
    log = open_log(source.path)
    log.check_ours()
    scenario, outcome = log.scenario(), (log.result or {}).get("outcome")
    method = source.method or (log.run or {}).get("controller", scenario.control.method)
    judgement = judged(log.trajectory(), scenario, outcome=outcome)
    return JudgedLog(source.path, scenario.name, method, scenario.seed, outcome, judgement)


def by_method(logs: Iterable[JudgedLog]) -> dict[str, MethodShares]:
    """The runs of each method together, in the order in which the methods come."""
    groups: dict[str, list[Judgement]] = {}
    for one in logs:
        groups.setdefault(one.method, []).append(one.judgement)
    return {method: _shares(found) for method, found in groups.items()}


def _shares(found: Sequence[Judgement]) -> MethodShares:
    collisions = [one.collision for one in found if one.collision is not None]
    return MethodShares(
        runs=len(found),
        at_fault=Share.of_truths([c.touch is not None and c.touch.at_fault for c in collisions]),
        avoidable=tuple(Share.of_truths([c.avoidable[i] for c in collisions]) for i in range(len(LEADS))),
        timeouts=Share.of_truths([one.timeout for one in found if one.timeout is not None]),
        rest=sum(one.rest.total for one in found) / len(found),
        rest_free=sum(one.rest.free for one in found) / len(found),
    )
