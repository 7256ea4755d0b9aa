"""A controller that hangs, ends its process or crashes costs its own episode, and no other."""

import json
import subprocess

from mjnav.study.store import Store
from tests.hanging_controllers import HANGING

STUDY = """
schema = 1
name = "attack"
scenes = ["crossing1"]
seeds = [0]
set = { time_limit = 0.6, physics.engine = "kinematic" }
"""


def test_an_episode_that_hangs_or_exits_is_a_failed_row_among_the_others(forked, tmp_path):
    (tmp_path / "attacking.py").write_text(HANGING)
    methods = ("mean", "attacking:Native", "attacking:Exiting")
    text = STUDY + "".join(f'[[methods]]\ncontroller = "{method}"\n' for method in methods)
    (tmp_path / "attack.toml").write_text(text)
    command = [*forked, "sweep", "attack.toml", "-o", "out", "--workers", "1", "--max-seconds", "1", "--json"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    printed = json.loads(done.stdout)
    place = f"{tmp_path}/attacking.py:"
    assert (done.returncode, printed["run"], printed["failed"], done.stderr) == (1, 3, 2, "")
    hung, ended = sorted(printed["causes"])
    assert hung.startswith(f"a tick hangs ({place}")
    assert hung.endswith("): ended after 1 s on the wall (--max-seconds)")
    assert ended == "the worker died: exit code 0, as os._exit does"
    rows = Store(tmp_path / "out").rows(["method", "outcome", "error"]).to_pylist()
    assert {row["method"] for row in rows if row["error"] is None} == {"mean"}
    assert {row["outcome"] for row in rows if row["error"] is not None} == {None}
