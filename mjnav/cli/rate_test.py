"""`mjnav rate-test SCENE --rate HZ --duration S`: does the loop keep its schedule on this machine?"""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from mjnav.cli import options
from mjnav.cli.main import INTERRUPTED
from mjnav.cli.terminal import answer, compile_notice, interruptible, progress, shown, tell
from mjnav.log.log_format import check_path
from mjnav.loop.prepare import load_scenario
from mjnav.loop.realtime.stress import shuttling
from mjnav.loop.run import warm_up
from mjnav.metrics.timing import FAIL, RULES
from mjnav.scene.overrides import overrides_of

MAX_NAMED = 10  # misses that are named in text
RATE = 50.0  # [Hz]


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.epilog = (
        "Where the process may, a test takes SCHED_FIFO, one CPU and locked memory, as run --real-time does."
    )
    options.run(parser)
    rate = f"of control, unless --set says it; {RATE:g} by default"
    parser.add_argument("--rate", type=float, default=RATE, metavar="HZ", help=rate)
    parser.add_argument("--duration", type=float, default=60.0, metavar="S", help="of the test [s]; 60 by default")
    parser.add_argument("--stress", action="store_true", help="load every processor and the disk meanwhile")
    parser.add_argument("--log", "-o", "--output", metavar="PATH", help="keep the log")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Runs the test and prints its verdict; 1 where it fails."""
    from mjnav.loop.realtime.rate_test import rate_test

    if arguments.log is not None:
        check_path(arguments.log)
    scenario = load_scenario(arguments.scene, arguments.overrides, controller=arguments.controller, seed=arguments.seed)
    set_rate = any(given.key == "control.rate" for given in overrides_of(arguments.overrides))
    case = shuttling(scenario, scenario.control.rate if set_rate else arguments.rate, arguments.duration)
    with interruptible() as interrupted:
        with compile_notice():
            warm_up(case)
        with progress(f"{case.name} at {case.control.rate:g} Hz", arguments.duration) as show:
            summary = rate_test(
                case, stressed=arguments.stress, log=arguments.log, stop=interrupted, progress=show, warmed_up=True
            ).summary
    answer(arguments, summary, lambda: print(*describe(summary), sep="\n"))
    if interrupted():
        tell("interrupted")
        return INTERRUPTED
    return 1 if summary["status"] == FAIL else 0


def describe(s: Mapping[str, Any]) -> Iterator[str]:
    """One test's report, for people, of its summary."""
    wake, gaps, blamed = s["wakeup_us"], s["machine_gaps"], s["longest_overrun"]
    yield f"{s['scene']}, {s['controller']}: {s['status']} at {s['requested_hz']:g} Hz"
    yield (
        f"  rate          {s['achieved_hz']:.4g} Hz achieved, {s['ticks']} ticks of {1e3 / s['requested_hz']:.4g} ms "
        f"({s['timestep_ms']:.3g} ms of physics a step), {shown(s['real_time_factor'], '.4f')} × real time"
    )
    yield f"  deadlines     {_missed(s)}, {s['skipped_periods']} periods skipped"
    yield from _longest(s["missed"])
    where = f" in tick {blamed['tick']}, phase {blamed['phase']}" if blamed else ""
    yield f"  overrun       {s['longest_overrun_ms']:.2f} ms{where}"
    levels = ", ".join(f"{shown(wake[key], '.1f')} {key}" for key in wake)
    yield f"  wake-up       µs behind the deadline: {levels}"
    yield f"  log           {s['log_dropped']} parts of ticks dropped"
    yield (
        f"  machine       {s['scheduler']}; memory {s['memory']}; {s['affinity']} of {s['cpus']}; {s['kernel']}; "
        f"{100 * s['stolen']:.1f} % of the processors stolen"
    )
    yield (
        f"  its gaps      {gaps['count']}, longest {gaps['longest_ms']:.2f} ms, {gaps['total_ms']:.2f} ms in all, seen "
        f"{gaps['seen']}"
    )
    yield f"  load          {s['load']}; load average {s['load_average']}"
    yield "  compute [ms]  p50     p99     max"
    for phase, values in s["compute_ms"].items():
        yield f"    {phase:10}" + "".join(f"  {shown(values[key], '6.3f')}" for key in ("p50", "p99", "max"))
    yield f"  {s['status']}, by the first of these that holds:"
    yield from (f"    {name:12}  {rule}" for name, rule in RULES)
    yield "    what was missed or skipped through the machine does not count"


def _missed(s: Mapping[str, Any]) -> str:
    """How many deadlines were missed, and through what."""
    causes = ", ".join(f"{count} by the {cause}" for cause, count in s["misses_by_cause"].items())
    return f"{s['deadline_misses']} of {s['ticks']} missed" + (f" ({causes})" if s["deadline_misses"] else "")


def _longest(misses: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """A line for each of the longest misses."""
    longest = sorted(misses, key=lambda miss: -miss["milliseconds"])[:MAX_NAMED]
    for miss in sorted(longest, key=lambda miss: miss["tick"]):
        where = f"{miss['phase']} of tick {miss['since']}"
        yield f"    tick {miss['tick']:<6d}  {miss['milliseconds']:.2f} ms over, {where}: the {miss['cause']}"
    if len(misses) > MAX_NAMED:
        yield f"    the longest {MAX_NAMED}"
