"""The log: one MCAP file a run, written while it goes and readable however it ended.

The only folder that imports mcap and protobuf.
"""

from mjnav.log.log_format import check_path
from mjnav.log.read.log import Log, TopicSummary, open_log
from mjnav.log.read.trajectory import TrajectoryBuilder
from mjnav.log.write.writer import Recorder

__all__ = ["Log", "Recorder", "TopicSummary", "TrajectoryBuilder", "check_path", "open_log"]
