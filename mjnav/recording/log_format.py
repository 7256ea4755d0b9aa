"""What writing, reading and recovering a log have in common: the names of its parts, its compression, its path."""

import os
from pathlib import Path
from typing import IO

from mcap.writer import CompressionType, Writer

from mjnav.errors import InputError

# metadata, and attachments
RUN, RESULT, RECOVERED = "mjnav/run", "mjnav/result", "mjnav/recovered"
SCENARIO, REPLAY, MODEL, LAYOUT = "scenario.toml", "replay.toml", "model.xml.gz", "foxglove-layout.json"

CHUNK_SIZE = 192 * 1024  # [bytes] before compression; LZ4 takes 40 % less time a tick than Zstandard and 20 % more room


def mcap_writer(file: IO[bytes]) -> Writer:
    """A writer of chunks with a checksum each, and one of all data at the end."""
    return Writer(file, chunk_size=CHUNK_SIZE, compression=CompressionType.LZ4, enable_data_crcs=True)


def check_path(path: str | os.PathLike) -> Path:
    """The path of a log that does not exist yet and could be written; creates nothing.

    Raises InputError where the file exists already, or its folder is missing or not writable.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError(f"{path}: a folder; a log needs the name of a file")
    if os.path.lexists(path):
        raise InputError(f"{path}: exists already, and a log never replaces a file; choose another name")
    folder = path.absolute().parent
    if not folder.is_dir():
        raise InputError(f"{path}: there is no folder {folder}")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"{path}: the folder {folder} is not writable")
    return path
