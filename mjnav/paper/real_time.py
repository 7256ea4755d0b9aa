"""The paper's real time: how long a decision takes, against samples, obstacles and the kernel's degree.

Runs are recorded with as many samples and people as asked, everyone in reach; then every one of their observations is
decided on again, by each degree in turn, in one thread. Beside these times stand those of the literal form: the Gram
matrices of one candidate and one obstacle, timed, times their number. All are this machine's, with what else it does at
the time; processor time leaves that out.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from math import inf
from time import perf_counter, thread_time
from typing import Any

import numpy as np

from mjnav.control.methods.rkhs import Rkhs
from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import build_controller
from mjnav.loop.realtime.crowd import crowd
from mjnav.messages import Array, Observation
from mjnav.metrics.intervals import paired_bootstrap
from mjnav.paper.decisions import spread, variant
from mjnav.paper.finding import Claim, Finding, Measured, judge
from mjnav.rkhs.mmd import mmd_squared_gram
from mjnav.rng import stream
from mjnav.scenarios.spec import Scenario

DEGREES = (1, 2, 3)
SAMPLES, OBSTACLES = 25, 5  # the paper's, and those held while the other grows
WARM_UP = 3  # decisions that are thrown away
GRAM_SAMPLES = 50  # more take hundreds of megabytes
RESAMPLES = 2000
SOURCE = "the claim of real time with 25 samples of robot and obstacle"


@dataclass(frozen=True, slots=True)
class Times:
    """How long n decisions took, one after another, of one size of problem."""

    degree: int
    samples: int
    obstacles: int
    seconds: Array  # (n,)
    cpu: Array  # (n,) of the processor
    gram: bool = False  # by Gram matrices: a lower bound, as only they are counted

    def quantile(self, share: float) -> tuple[float, float, float]:
        """Of the seconds, with its 95 % bootstrap interval over decisions."""
        low, high = np.quantile(self._resampled(share), [0.025, 0.975]).tolist()
        return float(np.quantile(self.seconds, share)), low, high

    def p_value(self, share: float, boundary: float) -> float:
        """Of that quantile being the boundary [s]: how often resamples lie on the rarer side of it, twice."""
        resampled = self._resampled(share)
        opposite = min((resampled <= boundary).sum(), (resampled >= boundary).sum())
        return min(1.0, 2.0 * float(1 + opposite) / (1 + resampled.size))

    def _resampled(self, share: float) -> Array:
        """The quantile of RESAMPLES resamples."""
        rng = stream(self.samples, "paper.real_time.bootstrap", f"{self.degree}, {self.obstacles}")
        drawn = self.seconds[rng.integers(self.seconds.size, size=(RESAMPLES, self.seconds.size))]
        return np.quantile(drawn, share, axis=1)

    def rate(self) -> tuple[float, float, float]:
        """Decisions a second, with its 95 % bootstrap interval over decisions."""
        rng = stream(self.samples, "paper.real_time.rate", f"{self.degree}, {self.obstacles}")
        low, high = paired_bootstrap(self.seconds, np.zeros_like(self.seconds), rng) or (inf, 0.0)
        return 1.0 / float(self.seconds.mean()), 1.0 / high, 1.0 / low


@dataclass(frozen=True, slots=True)
class RealTimeData:
    """Times of every size of problem; `period` [s] is the scene's."""

    scene: str
    period: float
    num_candidates: int
    times: tuple[Times, ...]

    def of(
        self, *, degree: int, samples: int | None = None, obstacles: int | None = None, gram: bool = False
    ) -> tuple[Times, ...]:
        """Those of a degree with so many samples and obstacles, in the order of their size; None is any number."""
        return tuple(
            t
            for t in sorted(self.times, key=lambda t: (t.samples, t.obstacles))
            if t.degree == degree and t.gram == gram and t.samples == (samples or t.samples)
            and t.obstacles == (obstacles or t.obstacles)
        )  # fmt: skip

    def rows(self) -> list[dict[str, Any]]:
        """One for every decision that was timed."""
        return [
            {"form": "gram" if t.gram else "moments", "degree": t.degree, "samples": t.samples}
            | {"obstacles": t.obstacles, "decision": i, "s": seconds, "cpu_s": cpu}
            for t in self.times
            for i, (seconds, cpu) in enumerate(zip(t.seconds.tolist(), t.cpu.tolist(), strict=True))
        ]


def measure(
    scenarios: Sequence[Scenario],
    *,
    quick: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> RealTimeData:
    """Of the first scenario, with more people or fewer. Raises InvalidValue for a method that is not `rkhs`."""
    scenario = scenarios[0]
    controller = build_controller(scenario)
    if not isinstance(controller, Rkhs):
        raise InvalidValue("control.method", scenario.control.method, "rkhs or rkhs-paper")
    ticks, repeat = (20, 2) if quick else (100, 3)
    sizes = [(n, OBSTACLES) for n in ((10, 25, 50) if quick else (10, 25, 50, 100, 200))]
    sizes += [(SAMPLES, j) for j in (1, 10)]
    found: list[Times] = []
    for done, (samples, obstacles) in enumerate(sizes):
        sized = _sized(scenario, samples, obstacles)
        observations = _observations(sized, ticks)
        found += _decisions(sized, observations, repeat if samples < 100 else 1)
        if samples <= (SAMPLES if quick else GRAM_SAMPLES) and obstacles == OBSTACLES:
            found += _gram(sized, observations, 3 if quick or samples == GRAM_SAMPLES else 20)
        progress(done + 1, len(sizes))
    p = controller.problem_parameters
    return RealTimeData(scenario.name, scenario.control.period, p.num_v * p.num_omega + 2, tuple(found))


def _sized(scenario: Scenario, samples: int, obstacles: int) -> Scenario:
    """The scenario with so many samples and people, all of them in reach."""
    sight = {"samples": samples, "sensing_range": inf, "max_obstacles": 1_000_000}
    control = replace(scenario.control, parameters={**scenario.control.parameters, **sight})
    return crowd(replace(scenario, control=control), obstacles)


def _observations(scenario: Scenario, num: int) -> list[Observation]:
    """What the first ticks of a run observe."""
    found: list[Observation] = []
    asked = count()
    Episode(scenario, watch=lambda record: found.append(record.observation), stop=lambda: next(asked) >= num).run()
    return found


def _decisions(scenario: Scenario, observations: Sequence[Observation], repeat: int) -> Iterator[Times]:
    """Times of all observations, `repeat` times over, by each degree in turn."""
    controllers = [variant(scenario, scenario.control.method, degree=degree) for degree in DEGREES]
    for controller in controllers:
        for observation in observations[:WARM_UP]:
            controller.decide(replace(observation))
    taken: list[list[tuple[float, float]]] = [[] for _ in DEGREES]
    for observation in [*observations] * repeat:
        for controller, times in zip(controllers, taken, strict=True):
            fresh = replace(observation)  # of one that it has seen, a controller knows the problem
            times.append(_timed(lambda controller=controller, fresh=fresh: controller.decide(fresh)))
    samples, obstacles = len(observations[0].robot_pose), len(observations[0].obstacles)
    for degree, times in zip(DEGREES, taken, strict=True):
        yield Times(degree, samples, obstacles, *np.array(times).T)


def _timed(function: Callable[[], object]) -> tuple[float, float]:
    """Seconds by the clock, and of this thread's processor."""
    began, cpu = perf_counter(), thread_time()
    function()
    return perf_counter() - began, thread_time() - cpu


def _gram(scenario: Scenario, observations: Sequence[Observation], num: int) -> Iterator[Times]:
    """Times of the Gram matrices of one candidate and obstacle, as many observations, times all of both."""
    taken = np.empty((len(DEGREES), num, 2))
    controller = build_controller(scenario)
    assert isinstance(controller, Rkhs)
    chosen = list(spread(observations, num))
    for i in range(num):
        problem = controller.problem(chosen[i % len(chosen)])
        c = problem.candidates
        f = problem.cone.samples(0, c.v[:1], c.omega[:1])[:, 0]
        desired = np.append(controller.desired_cone(problem, 0), 0.0)  # never empty
        for d, degree in enumerate(DEGREES):
            times = _timed(lambda f=f, desired=desired, degree=degree: mmd_squared_gram(f, desired, degree=degree))
            taken[d, i] = np.array(times) * len(c.v) * len(problem.cone.blocks.column)
    samples, obstacles = len(chosen[0].robot_pose), len(chosen[0].obstacles)
    for degree, times in zip(DEGREES, taken, strict=True):
        yield Times(degree, samples, obstacles, *times.T, gram=True)


def findings(data: RealTimeData) -> tuple[Finding, ...]:
    """Of real time with the paper's number of samples, by moments and by Gram matrices."""
    return judge([_claim(data, gram) for gram in (False, True)])


def _claim(data: RealTimeData, gram: bool) -> Claim:
    slowest, p, texts = -inf, 1.0, []
    for degree in DEGREES:
        (times,) = data.of(degree=degree, samples=SAMPLES, obstacles=OBSTACLES, gram=gram)
        middle, (p99, low, high), (rate, slow, fast) = times.quantile(0.5)[0], times.quantile(0.99), times.rate()
        if p99 > slowest:
            slowest, p = p99, times.p_value(0.99, data.period)
        texts.append(
            f"d = {degree}: median {_ms(middle)}, p99 {_ms(p99)} [{_ms(low)}, {_ms(high)}], {rate:.3g} [{slow:.3g}, "
            f"{fast:.3g}] decisions a second (n = {times.seconds.size}); processor time p99 "
            f"{_ms(float(np.quantile(times.cpu, 0.99)))}"
        )
    how = "by Gram matrices of all pairs, as it is written" if gram else "by moments, as here"
    return Claim(
        f"With {SAMPLES} samples of robot and obstacles the method decides in real time, {how}.",
        SOURCE,
        [Measured(slowest < data.period, p)],
        f"{OBSTACLES} obstacles, {data.num_candidates} candidates, period {_ms(data.period)}, on this machine. "
        f"{'. '.join(texts)}.",
    )


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms"
