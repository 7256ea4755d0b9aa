"""server.py SOCKET: starts `mjnav` commands as processes of their own, forked from one that has everything warm.

A connection is a command. The request is JSON, {"argv": [...], "folder": path, "environment": {...}, "ignore":
[signals]}, with the descriptors of standard input, output and error. The answer is a line with the number of its
process, and, when it has ended, a line with its exit code, negative where a signal ended it. The server ends when its
own standard input does.
"""

import gc
import json
import os
import select
import signal
import socket
import sys
import tempfile
from contextlib import suppress
from importlib import import_module
from pathlib import Path

from mjnav.cli.main import COMMANDS, main
from mjnav.cli.terminal import guarded

HEAVY = ("matplotlib.pyplot", "mjnav.log.export.export", "mjnav.study.compare.study_comparison")


def warm_up() -> None:
    """Imports what commands import, and loads the kernels of runs."""
    for module in (*(path for path, _ in COMMANDS.values()), *HEAVY):
        import_module(module)
    with tempfile.TemporaryDirectory() as folder:
        for method, words in (("mean", []), ("rkhs", ["--real-time"])):
            log = os.path.join(folder, f"{method}.mcap")
            main(["run", "crossing1", "--controller", method, "--log", log, "--set", "time_limit=0.3", *words])
            main(["report", log])
    assert len(list(Path("/proc/self/task").iterdir())) == 1  # a fork would take one thread along, and others' locks


def become(request: dict, descriptors: list[int]) -> None:
    """What an interpreter that was started for this would find."""
    os.environ.clear()
    os.environ.update(request["environment"])
    os.chdir(request["folder"])
    signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever started the tests may have it ignored
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    for number in request["ignore"]:
        signal.signal(number, signal.SIG_IGN)
    for target, source in enumerate(descriptors):
        os.dup2(source, target)
        os.close(source)


def serve(listener: socket.socket) -> list[str]:
    """Answers until the server's input ends, and then as a child with the words of its command."""
    while listener in select.select([listener, sys.stdin], [], [])[0]:
        with suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
        connection, _ = listener.accept()
        if os.fork() == 0:  # a process that waits for the command's
            listener.close()
            message, descriptors, _, _ = socket.recv_fds(connection, 1 << 20, 3)
            number = os.fork()
            if number == 0:
                connection.close()
                request = json.loads(message)
                become(request, descriptors)
                return request["argv"]
            for descriptor in descriptors:
                os.close(descriptor)
            connection.sendall(f"{number}\n".encode())
            _, status = os.waitpid(number, 0)
            with suppress(BrokenPipeError):  # nobody asks any more
                connection.sendall(f"{os.waitstatus_to_exitcode(status)}\n".encode())
            os._exit(0)
        connection.close()
    sys.exit(0)


if __name__ == "__main__":
    with open(os.devnull, "w") as nowhere, socket.socket(socket.AF_UNIX) as listener:
        answers, sys.stdout = sys.stdout, nowhere
        warm_up()
        sys.stdout = answers
        listener.bind(sys.argv[1])
        listener.listen()
        print("ready", flush=True)
        gc.freeze()  # collections of a child, and its end, leave the pages that it shares alone
        words = serve(listener)
        sys.exit(guarded(lambda guard: main(words, guard=guard)))
