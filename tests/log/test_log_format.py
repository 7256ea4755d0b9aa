"""A log of another format is refused in a line."""

import pytest

from mjnav.errors import InputError
from mjnav.log import Recorder, log_format, open_log


@pytest.mark.parametrize("other", ["1", "3", "x" * 1000])
def test_another_format_is_refused_in_one_line(tmp_path, scenario, made_up, monkeypatch, other):
    with monkeypatch.context() as patched:
        patched.setattr(log_format, "FORMAT", other)
        with Recorder(tmp_path / "run.mcap", scenario, {"scene": "made-up"}, "<mujoco/>") as recorder:
            recorder.write(made_up.record(0))
    with pytest.raises(InputError, match=r"of log format '.{1,20}'; this version of mjnav reads 2$"):
        open_log(tmp_path / "run.mcap")
