"""Each log judged by the oracle, and the methods beside one another."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mjnav.metrics.intervals import Interval, wilson
from mjnav.metrics.oracle.avoidable import LEADS, Judgement, judged
from mjnav.recording.read.log import open_log
from mjnav.study.avoidable.sources import Source


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
