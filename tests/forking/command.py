"""command.py SOCKET WORDS...: runs `mjnav` with these words, as a process that `server.py` forks.

Output and exit code are the command's. Imports the standard library only, so that it starts at once.
"""

import json
import os
import select
import signal
import socket
import sys
from collections.abc import Iterable, Mapping, Sequence


class Command:
    """A command that the server has started; `number` is its process."""

    def __init__(
        self,
        server: str,
        argv: Sequence[str],
        folder: str,
        environment: Mapping[str, str],
        descriptors: Sequence[int] = (0, 1, 2),
        ignore: Iterable[int] = (),
    ):
        request = {"argv": argv, "folder": folder, "environment": dict(environment), "ignore": list(ignore)}
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect(server)
            socket.send_fds(connection, [json.dumps(request).encode()], descriptors)
            self._answers = connection.makefile("r")
        self.number = int(self._answers.readline())

    def has_ended(self) -> bool:
        """Whether `code` would not wait."""
        return bool(select.select([self._answers], [], [], 0.0)[0])

    def code(self) -> int:
        """Waits for its end and returns its exit code."""
        with self._answers:
            return int(self._answers.readline())


if __name__ == "__main__":
    command = Command(sys.argv[1], sys.argv[2:], os.getcwd(), os.environ)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda number, _: os.kill(command.number, number))
    code = command.code()
    sys.exit(code if code >= 0 else 128 - code)  # as a shell gives that of its child
