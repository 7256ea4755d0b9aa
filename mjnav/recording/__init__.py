"""The log: one MCAP file a run, written while it goes and readable however it ended.

The only folder that imports mcap and protobuf.
"""

from mjnav.recording.read.reader import Log, open_log
from mjnav.recording.read.survey import TopicSummary
from mjnav.recording.read.trajectory import TrajectoryBuilder
from mjnav.recording.write.writer import Recorder, check_path

__all__ = ["Log", "Recorder", "TopicSummary", "TrajectoryBuilder", "check_path", "open_log"]
