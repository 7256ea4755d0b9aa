"""A log and its bag."""

from collections import defaultdict

import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from mjnav.log import open_log
from mjnav.log.export.export import export


@pytest.fixture(scope="session")
def log(recorded):
    return open_log(recorded)


@pytest.fixture(scope="session")
def folder(log, tmp_path_factory):
    path = tmp_path_factory.mktemp("rosbag2") / "bag"
    export(log, "rosbag2", path)
    return path


@pytest.fixture(scope="session")
def bag(folder):
    """Time [ns] and message, read as a distribution of today reads them, by topic."""
    store, found = get_typestore(Stores.ROS2_JAZZY), defaultdict(list)
    with Reader(folder) as reader:
        for connection, time_ns, data in reader.messages():
            found[connection.topic].append((time_ns, store.deserialize_cdr(data, connection.msgtype)))
    return found
