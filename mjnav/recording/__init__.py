"""The log: one MCAP file a run, written while it goes and readable however it ended.

The only folder that imports mcap and protobuf.
"""

from mjnav.recording.reader import Log, open_log
from mjnav.recording.survey import TopicSummary
from mjnav.recording.trajectory import TrajectoryBuilder
from mjnav.recording.writer import Recorder, check_path

__all__ = ["Log", "Recorder", "TopicSummary", "TrajectoryBuilder", "check_path", "open_log"]
