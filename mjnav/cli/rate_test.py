"""`mjnav rate-test SCENE --rate HZ --duration S`: does the loop keep its schedule on this machine?"""

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from math import inf

from mjnav.cli.main import INTERRUPTED
from mjnav.cli.options import scene_options
from mjnav.cli.options.common import check_needs
from mjnav.cli.terminal.guard import interruptible
from mjnav.cli.terminal.progress import compile_notice, progress
from mjnav.cli.terminal.tables import print_lines, width
from mjnav.errors import InvalidValue
from mjnav.log.log_format import check_path
from mjnav.loop.prepare import load_scenario
from mjnav.loop.realtime.rate_test import RateTest, rate_test
from mjnav.loop.realtime.stress import crowd, shuttling
from mjnav.loop.run import warm_up
from mjnav.metrics.timing import FAIL, FIRST_TIME, LOOP, MACHINE, PASS, RULES, Miss, histogram
from mjnav.scene.spec import Scenario

MAX_NAMED = 10  # misses that are named in text
_BY = {LOOP: "the loop", MACHINE: "the machine", FIRST_TIME: "first-time work"}
BAR = 40  # [characters] of the longest
BEFORE_BARS = 31  # [characters] of a bar's name and count
LATENESS_EDGES = (2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000, 100_000)  # [us]
BUSY_EDGES = tuple(range(10, 160, 10))  # [% of the period]
RATE = 50.0  # [Hz]


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.epilog = (
        "Where the process may, a test takes SCHED_FIFO, one CPU and locked memory, as run --real-time does."
    )
    scene_options.configure(parser)
    rates = parser.add_mutually_exclusive_group()
    rates.add_argument("--rate", type=float, default=RATE, metavar="HZ", help=f"of control; {RATE:g} by default")
    rates.add_argument("--sweep", metavar="HZ,HZ,...", help="several rates: which is the highest that passes?")
    parser.add_argument("--people", metavar="N,N,...", help="these numbers of people in place of the scene's")
    parser.add_argument("--samples", metavar="N,N,...", help="these numbers of samples of each belief")
    parser.add_argument("--duration", type=float, default=60.0, metavar="S", help="of each test [s]; 60 by default")
    parser.add_argument("--stress", action="store_true", help="load every processor and the disk meanwhile")
    parser.add_argument("--log", "-o", "--output", metavar="PATH", help="keep the log of a single test")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Runs the tests and prints what came of them; 1 where the test, or every test of a sweep, fails."""
    rates = [arguments.rate] if arguments.sweep is None else _numbers("--sweep", arguments.sweep, float)
    people = [None] if arguments.people is None else _numbers("--people", arguments.people, int)
    samples = [None] if arguments.samples is None else _numbers("--samples", arguments.samples, int)
    cases = [(n, m, rate) for n in people for m in samples for rate in sorted(rates)]
    check_needs("--log", "a single test", given=arguments.log is not None, met=len(cases) == 1)
    if arguments.log is not None:
        check_path(arguments.log)
    single = len(cases) == 1 and arguments.sweep is None

    tests: list[tuple[int | None, int | None, RateTest]] = []
    with interruptible() as interrupted:
        for case in _prepared(arguments, cases):
            tests.append((*case[:2], _run(arguments, case, interrupted)))
            if not single and not arguments.json:
                print_lines([_line(*tests[-1])])
                sys.stdout.flush()
            if interrupted():
                break
    statuses = [test.status for *_, test in tests]
    if single:
        if arguments.json:
            print(json.dumps(tests[0][2].summary))
        else:
            print_lines(describe(tests[0][2], width()).splitlines())
    elif arguments.json:
        print(json.dumps(_sweep_summary(tests)))
    else:
        print("\n".join(_highest(tests)))
    if interrupted():
        print("mjnav: interrupted", file=sys.stderr)
        return INTERRUPTED
    return 1 if all(status == FAIL for status in statuses) else 0


Case = tuple[int | None, int | None, float, Scenario]


def _prepared(arguments: argparse.Namespace, cases: Sequence[tuple[int | None, int | None, float]]) -> list[Case]:
    """Each case with its scenario: all are checked before the first runs."""
    prepared = []
    for people, samples, rate in cases:
        overrides = [*arguments.overrides, *([] if samples is None else [f"control.samples={samples}"])]
        scenario = load_scenario(arguments.scene, overrides, controller=arguments.controller, seed=arguments.seed)
        if people is not None:
            scenario = crowd(scenario, people)
        prepared.append((people, samples, rate, shuttling(scenario, rate, arguments.duration)))
    return prepared


def _run(arguments: argparse.Namespace, case: Case, stop: Callable[[], bool]) -> RateTest:
    *_, rate, scenario = case
    with compile_notice():
        warm_up(scenario)
    with progress(f"{scenario.name} at {rate:g} Hz", arguments.duration) as show:
        return rate_test(
            scenario, stressed=arguments.stress, log=arguments.log, stop=stop, progress=show, warmed_up=True
        )


def _numbers(key: str, text: str, kind: type) -> list:
    """What a list of numbers on the command line says."""
    try:
        return [kind(word) for word in text.split(",")]
    except ValueError:
        whole = "whole numbers" if kind is int else "numbers"
        raise InvalidValue(key, text, f"{whole} with commas between them") from None


def describe(test: RateTest, width: int) -> str:
    """One test's report, for people; its bars are at most `width` [characters] from the left."""
    s, m, got, schedule = test.summary, test.machine, test.machine.scheduling, test.schedule
    wake, overrun, faults, gaps = test.wakeup_us, test.overrun, test.page_faults, test.gaps.summary
    lines = [
        f"{test.scene}, {test.controller}: {test.status} at {test.requested_hz:g} Hz",
        f"  rate          {schedule.achieved_hz:.4g} Hz achieved, {schedule.ticks} ticks of "
        f"{1e3 * schedule.period:.4g} ms ({1e3 * test.timestep:.3g} ms of physics a step), "
        f"{_text(s['real_time_factor'], '.4f')} × real time",
        f"  deadlines     {schedule.misses} of {schedule.ticks} missed{_causes(test)}, "
        f"{schedule.skipped} periods skipped",
        *_named(test.blame.misses),
        "  overrun       "
        + (f"{overrun.milliseconds:.2f} ms in tick {overrun.tick}, phase {overrun.phase}" if overrun else "none"),
        f"  wake-up       {_text(wake['p50'], '.1f')} µs p50, {_text(wake['p99'], '.1f')} p99, "
        f"{_text(wake['p999'], '.1f')} p99.9, {_text(wake['max'], '.1f')} max behind the deadline",
        f"  log           {schedule.log_dropped} parts of ticks dropped",
        f"  machine       {got.scheduler}; memory {got.memory}; {got.affinity} of {m.cpus}; {m.kernel}; "
        f"{100 * schedule.stolen:.1f} % of the processors stolen",
        f"  its gaps      {gaps['count']}, longest {gaps['longest_ms']:.2f} ms, {gaps['total_ms']:.2f} ms in all, seen "
        f"{gaps['seen']}",
        f"  load          {m.load}; load average {m.load_average}",
        f"  page faults   {_text(faults['p50'], '.0f')} a tick p50, {_text(faults['p99'], '.0f')} p99, "
        f"{_text(faults['max'], '.0f')} max",
        "  compute [ms]  p50     p99     max",
    ]
    for phase, values in test.compute_ms.items():
        lines.append(f"    {phase:10}" + "".join(f"  {_text(values[key], '6.3f')}" for key in ("p50", "p99", "max")))
    lines += ["", "  start of ticks behind their deadline [µs]"]
    lines += _bars(histogram(schedule.lateness * 1e-3, LATENESS_EDGES), "", width)
    lines += ["", "  work of ticks [% of the period]"]
    lines += _bars(histogram(schedule.busy * 1e-7 / schedule.period, BUSY_EDGES), " %", width)
    lines += ["", f"  {test.status}, by the first of these that holds:"]
    lines += [f"    {name:12}  {rule}" for name, rule in RULES]
    lines += ["    what was missed or skipped through the machine does not count"]
    return "\n".join(lines)


def _causes(test: RateTest) -> str:
    """How many deadlines were missed through whom."""
    counts = [f"{count} by {_BY[cause]}" for cause, count in test.blame.counts.items()]
    return f" ({', '.join(counts)})" if test.schedule.misses else ""


def _named(misses: Sequence[Miss]) -> Iterator[str]:
    """A line for each of the longest."""
    longest = sorted(misses, key=lambda miss: -miss.milliseconds)[:MAX_NAMED]
    for miss in sorted(longest, key=lambda miss: miss.tick):
        where = miss.phase if miss.since == miss.tick else f"{miss.phase} of tick {miss.since}"
        yield f"    tick {miss.tick:<6d}  {miss.milliseconds:.2f} ms over, {where}: {_BY[miss.cause]}"
    if len(misses) > MAX_NAMED:
        yield f"    the longest {MAX_NAMED}"


def _bars(rows: list[tuple[float, float, int]], unit: str, width: int) -> Iterator[str]:
    longest = max(1, min(BAR, width - BEFORE_BARS))
    most = max((count for *_, count in rows), default=1)
    for low, high, count in rows:
        name = (
            f"under {high:g}{unit}"
            if low == -inf
            else f"over {low:g}{unit}"
            if high == inf
            else f"{low:g} to {high:g}{unit}"
        )
        bar = "█" * max(1, round(longest * count / most)) if count else ""
        yield f"    {name:>16}  {count:7d}  {bar}".rstrip()


def _line(people: int | None, samples: int | None, test: RateTest) -> str:
    """One test of several."""
    s = test.summary
    with_what = "".join(f", {n} {what}" for n, what in ((people, "people"), (samples, "samples")) if n is not None)
    tick = test.compute_ms["tick"]
    return (
        f"{test.requested_hz:6g} Hz{with_what}: {test.status:12}  {s['deadline_misses']} of {s['ticks']} missed"
        f"{_causes(test)}, "
        f"longest overrun {s['longest_overrun_ms']:.2f} ms; tick {_text(tick['p50'], '.2f')} ms p50, "
        f"{_text(tick['p99'], '.2f')} p99, "
        f"{100 * (tick['p99'] or 0.0) * 1e-3 / test.schedule.period:.0f} % of the period"
    )


def _highest(tests: Sequence[tuple[int | None, int | None, RateTest]]) -> Iterator[str]:
    for (people, samples), rate in _passing(tests).items():
        of_what = [f"{n} {what}" for n, what in ((people, "people"), (samples, "samples")) if n is not None]
        place = f"with {' and '.join(of_what)}: " if of_what else ""
        yield f"{place}the highest rate that passes is {rate:g} Hz" if rate else f"{place}no rate passes"


def _passing(tests: Sequence[tuple[int | None, int | None, RateTest]]) -> dict[tuple, float | None]:
    """The highest rate that passes by people and samples."""
    found: dict[tuple, float | None] = {}
    for people, samples, test in tests:
        best = found.setdefault((people, samples), None)
        if test.status == PASS:
            found[people, samples] = max(best or 0.0, test.requested_hz)
    return found


def _sweep_summary(tests: Sequence[tuple[int | None, int | None, RateTest]]) -> dict[str, object]:
    return {
        "schema": 1,
        "tests": [{"people": people, "samples": samples, **test.summary} for people, samples, test in tests],
        "highest_passing_hz": [
            {"people": people, "samples": samples, "hz": rate} for (people, samples), rate in _passing(tests).items()
        ],
    }


def _text(value: object, form: str) -> str:
    return "-" if value is None else format(value, form)
