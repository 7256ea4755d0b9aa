r"""The table of docs/realtime.md, measured again: deadlines missed by rate, load and privileges, and each verdict.

    uv run python benchmarks/rate_table.py [SCENE] [--controller NAME] [--rates HZ,HZ,...] [--duration S] \
        [--rows NAME ...]

Each test is a process of its own. A cell holds the misses of the loop, of the machine and of first-time work, summed
over the repeats, and every verdict. Rows are those of ROWS; each has a duration of its own unless --duration is given.
It takes 40 minutes as it stands, and means something on a machine that does nothing else.
"""

import argparse
import json
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import NamedTuple

UNPRIVILEGED = Path(__file__).parents[1] / "tests" / "unprivileged.py"
LOCKED = 64 << 10  # [bytes] that a process without privileges may lock
CAUSES = ("loop", "machine", "first-time work")


class Row(NamedTuple):
    name: str
    stress: bool
    privileged: bool
    duration: float  # [s]


ROWS = {
    "idle": Row("idle", False, True, 60.0),
    "stress": Row("`--stress`", True, True, 30.0),
    "unprivileged": Row("idle, without privileges", False, False, 30.0),
    "both": Row("`--stress`, without privileges", True, False, 30.0),
}


def test(scene: list[str], rate: float, row: Row, duration: float) -> dict:
    """What one rate test reports; `scene` are the words that name it, and its controller."""
    command = [sys.executable, "-m", "mjnav.cli.main", "rate-test", *scene, "--rate", f"{rate:g}", "--json"]
    command += ["--duration", f"{duration:g}", *(["--stress"] if row.stress else [])]
    if not row.privileged:
        command = [sys.executable, str(UNPRIVILEGED), str(LOCKED), *command]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=False).stdout)


def cell(reports: list[dict]) -> str:
    """The repeats of a test in a few words: 2 + 0 + 1 of 9000, PASS PASS DEGRADED."""
    counts = Counter()
    for report in reports:
        counts.update(report["misses_by_cause"])
    missed = " + ".join(str(counts[cause]) for cause in CAUSES)
    statuses = [report["status"] for report in reports]
    verdicts = f"{len(statuses)} × {statuses[0]}" if len(set(statuses)) == 1 else " ".join(statuses)
    return f"{missed} of {sum(report['ticks'] for report in reports)}, {verdicts}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default="hall")
    parser.add_argument("--controller", help="in place of the scene's own")
    parser.add_argument("--rates", default="10,20,50,100,200", metavar="HZ,HZ,...")
    parser.add_argument("--duration", type=float, help="of each test [s], in place of the rows' own")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--rows", nargs="+", default=list(ROWS), choices=ROWS)
    arguments = parser.parse_args()
    rates = [float(word) for word in arguments.rates.split(",")]

    scene = [arguments.scene, *([] if arguments.controller is None else ["--controller", arguments.controller])]
    test(scene, rates[0], ROWS["idle"], 0.2)  # compiles
    print(f"|  | {' | '.join(f'{rate:g} Hz' for rate in rates)} |")
    print(f"|---|{'---|' * len(rates)}", flush=True)
    gaps, machine = [], ""
    for name in arguments.rows:
        row = ROWS[name]
        duration = arguments.duration or row.duration
        cells = []
        for rate in rates:
            reports = [test(scene, rate, row, duration) for _ in range(arguments.repeats)]
            cells.append(cell(reports))
            gaps += [report["machine_gaps"] for report in reports]
            machine = f"{reports[0]['cpus']} CPUs, {reports[0]['kernel']}"
        print(f"| {row.name}, {duration:g} s each | {' | '.join(cells)} |", flush=True)
    print(f"\nDeadlines missed by the loop + by the machine + by first-time work, {arguments.repeats} tests a cell.")
    longest = max(found["longest_ms"] for found in gaps)
    total = sum(found["total_ms"] for found in gaps)
    print(f"{machine}; the machine stood still {sum(found['count'] for found in gaps)} times in all, ", end="")
    print(f"{longest:.1f} ms at most, {total:.1f} ms together.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
