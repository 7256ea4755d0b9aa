"""The log: one MCAP file a run, written while it goes and readable however it ended.

The only folder that imports mcap and protobuf.
"""

from mjnav.recording.log_format import check_path
from mjnav.recording.read.log import Log, TopicSummary, open_log
from mjnav.recording.read.trajectory import TrajectoryBuilder
from mjnav.recording.write.writer import Recorder

__all__ = ["Log", "Recorder", "TopicSummary", "TrajectoryBuilder", "check_path", "open_log"]
