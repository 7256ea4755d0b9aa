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
from mjnav.metrics.oracle import Collision, judged
from mjnav.study.cells import DEFAULT_SETTING
from mjnav.study.keep import kept_log
from mjnav.study.results import find_results
from mjnav.study.store import Store

_COLUMNS = ("scene", "setting", "method", "seed", "success", "error", "log")


@dataclass(frozen=True, slots=True)
class Source:
    """A log, and the name that its study gives the method; None of a log without a study."""

    path: Path
    method: str | None = None


def sources(given: str) -> tuple[Sequence[Source], str | None]:
    """The logs that `given` names, and of a study a line on how many it kept.

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


def _of_study(store: Store) -> tuple[Sequence[Source], str]:
    logs, failures, lacking = [], 0, 0
    rows = store.rows(_COLUMNS).to_pylist()
    for row in sorted(rows, key=lambda row: [row[name] for name in ("method", "setting", "scene", "seed")]):
        log = kept_log(store.folder, row["log"])
        failed = row["error"] is None and not row["success"]
        failures += failed
        lacking += failed and log is None
        if log is not None:
            setting = "" if row["setting"] == DEFAULT_SETTING else f", {row['setting']}"
            logs.append(Source(log, f"{row['method']}{setting}"))
    keep = "mjnav sweep STUDY --keep-logs failures keeps those of episodes that fail"
    if not logs:
        raise InputError(f"{store.folder}: kept no logs; {keep}")
    note = f"{store.folder}: logs of {len(logs)} of {len(rows)} episodes"
    if lacking:
        note = f"{note}; {lacking} of {failures} failures have none: {keep}"
    elif len(logs) < len(rows):
        note = f"{note}, every failure among them: shares are the study's, times at rest those of these runs alone"
    return logs, note


@dataclass(frozen=True, slots=True)
class CollisionVerdict:
    """What the oracle says of the first contact of a run."""

    time_s: float
    kind: str
    name: str
    who_moved: str | None  # in words; this and the next two are None of a thing
    robot_moved: bool | None
    robot_at_fault: bool | None
    avoidable_2s_before: bool
    avoidable_1s_before: bool
    last_chance_s_before: float | None  # None without one


@dataclass(frozen=True, slots=True)
class RunVerdict:
    """What the oracle says of one run."""

    log: str
    scene: str
    method: str
    seed: int | None
    outcome: str | None  # None of a run that did not end
    collision: CollisionVerdict | None
    timeout_avoidable: bool | None
    stalled_s: float
    stalled_way_free_s: float


@dataclass(frozen=True, slots=True)
class Share:
    """How many of how many, with Wilson's interval, 95 %; None of nothing."""

    count: int
    of: int
    interval: Interval

    @classmethod
    def of_truths(cls, truths: Sequence[bool]) -> "Share":
        """How many are true."""
        return cls(sum(truths), len(truths), wilson(sum(truths), len(truths)))


@dataclass(frozen=True, slots=True)
class MethodShares:
    """The runs of one method, over all scenes."""

    runs: int
    robot_at_fault: Share  # collisions with a person that were the robot's fault, of all collisions
    avoidable_2s_before: Share  # of the collisions
    avoidable_1s_before: Share
    timeout_avoidable: Share  # of the time-outs
    mean_stalled_s: float
    mean_stalled_way_free_s: float


def judge(source: Source) -> RunVerdict:
    """Opens a log and asks the oracle. Raises what `open_log` and `Log.trajectory` raise."""
    log = open_log(source.path)
    log.check_ours()
    scenario, outcome = log.scenario(), (log.result or {}).get("outcome")
    judgement = judged(log.trajectory(), scenario, outcome=outcome)
    return RunVerdict(
        log=str(source.path),
        scene=scenario.name,
        method=source.method or (log.run or {}).get("controller", scenario.control.method),
        seed=scenario.seed,
        outcome=outcome,
        collision=None if judgement.collision is None else _verdict(judgement.collision),
        timeout_avoidable=judgement.timeout,
        stalled_s=judgement.rest.total,
        stalled_way_free_s=judgement.rest.free,
    )


def _verdict(collision: Collision) -> CollisionVerdict:
    contact, touch, (two_seconds, one_second) = collision.contact, collision.touch, collision.avoidable
    return CollisionVerdict(
        time_s=contact.time,
        kind=contact.kind,
        name=contact.name,
        who_moved=None if touch is None else str(touch),
        robot_moved=None if touch is None else touch.moving,
        robot_at_fault=None if touch is None else touch.at_fault,
        avoidable_2s_before=two_seconds,
        avoidable_1s_before=one_second,
        last_chance_s_before=collision.last_chance,
    )


def by_method(runs: Iterable[RunVerdict]) -> dict[str, MethodShares]:
    """The runs of each method together, in the order in which the methods come."""
    groups: dict[str, list[RunVerdict]] = {}
    for run in runs:
        groups.setdefault(run.method, []).append(run)
    return {method: _shares(of_method) for method, of_method in groups.items()}


def _shares(runs: Sequence[RunVerdict]) -> MethodShares:
    collisions = [run.collision for run in runs if run.collision is not None]
    return MethodShares(
        len(runs),
        Share.of_truths([bool(collision.robot_at_fault) for collision in collisions]),
        Share.of_truths([collision.avoidable_2s_before for collision in collisions]),
        Share.of_truths([collision.avoidable_1s_before for collision in collisions]),
        Share.of_truths([run.timeout_avoidable for run in runs if run.timeout_avoidable is not None]),
        mean_stalled_s=sum(run.stalled_s for run in runs) / len(runs),
        mean_stalled_way_free_s=sum(run.stalled_way_free_s for run in runs) / len(runs),
    )
