"""gap_spinner.py CPU: a program that spins on one CPU and sees when the machine stood still.

It reads the clock over and over, as Linux's hwlatdetect does. Where two readings are far apart, and the kernel does not
say that this process waited for its CPU meanwhile, it stood still: the hypervisor or the firmware took the machine
away, or this process was stopped together with those beside it. What it waited because other processes had its CPU, or
because the kernel throttled it, stands in /proc/self/schedstat and is taken off.

A hypervisor may also take away this one CPU. Where it tells the kernel, as steal time, the kernel does not charge that
to this process, which has neither left its CPU nor used it: such a gap says nothing of other CPUs.

It prints a line when it begins, and one of JSON on SIGTERM or with the end of its parent: the CPU, how long it spun and
waited [ns], and each gap by its begin, its end (CLOCK_MONOTONIC) [ns] and 1 where it is one of this CPU alone. It
imports nothing of mjnav, so that it starts quickly.
"""

import gc
import json
import os
import signal
import sys
import time

GAP = 500_000  # [ns] that the machine stood still, at least


def main() -> None:
    """Spins."""
    for number in (signal.SIGINT, signal.SIGHUP):  # a terminal sends them to the group; the parent ends this process
        signal.signal(number, signal.SIG_IGN)
    asked: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, frame: asked.append(number))
    # It must not delay others. A loop under SCHED_FIFO is not delayed by ordinary processes; any other loop is.
    policy = os.SCHED_OTHER if os.sched_getscheduler(0) == os.SCHED_FIFO else os.SCHED_IDLE
    os.sched_setscheduler(0, policy, os.sched_param(0))
    cpu, parent = int(sys.argv[1]), os.getppid()
    os.sched_setaffinity(0, {cpu})
    gc.disable()
    gaps: list[tuple[int, int, int]] = []
    with open("/proc/self/schedstat", "rb", buffering=0) as file:
        statistics = file.fileno()

        def read() -> tuple[int, int, int]:
            """Time spent waiting for the CPU [ns], how often this process got it, and time spent on it [ns], so far."""
            _, waited, turns = os.pread(statistics, 64, 0).split()
            return int(waited), int(turns), time.thread_time_ns()

        print(flush=True)
        earlier = last = first = read()
        began = before = time.monotonic_ns()
        finished = False
        while not finished:  # a last look after SIGTERM: what it waited until then counts
            finished = bool(asked) or os.getppid() != parent
            now = time.monotonic_ns()
            usage = read()
            # What was read before `before` and after `now`: nothing that lies between them is left out.
            stood_still = now - before - (usage[0] - earlier[0])
            if stood_still > GAP and 2 * stood_still > now - before:  # not where most of it was waited
                stolen = usage[1] == earlier[1] and 2 * (usage[2] - earlier[2]) < stood_still
                gaps.append((before, now, int(stolen)))
            before, last, earlier = now, usage, last
    print(json.dumps({"cpu": cpu, "spun": before - began, "waited": last[0] - first[0], "gaps": gaps}))


if __name__ == "__main__":
    main()
