"""killed_writer.py PATH PAUSE SINK: records a tick every PAUSE seconds until it is killed, and says when."""

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from conftest import MadeUpRun, make_scenario

from mjnav.log import Recorder


def main() -> None:
    path, pause, threaded = sys.argv[1], float(sys.argv[2]), sys.argv[3] == "thread"
    run = MadeUpRun(num_candidates=50)
    records = [run.record(tick) for tick in range(20)]
    with Recorder(path, make_scenario(), {"scene": "made-up"}, "<mujoco/>", threaded=threaded) as recorder:
        for tick in range(1_000_000):
            recorder.write(run.at(records[tick % 20], tick))
            recorder.write_timing(run.timing(tick))
            print(tick, time.monotonic(), flush=True)
            time.sleep(pause)


main()
