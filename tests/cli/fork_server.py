"""fork_server.py: starts `mjnav` commands as processes of their own, forked from one that has everything warm.

Reads a request a line and answers with a line, JSON both: {"argv": [...], "folder": path, "ignore": [signals], "pipe":
bool} gives the process's number, {"wait": number} its exit code when it has ended, null before. Output goes to files in
its folder, NUMBER.out and NUMBER.err, or, where "pipe" is true, standard output to a pipe that nobody reads.
"""

import json
import os
import signal
import sys
import tempfile

from mjnav.cli.main import main
from mjnav.cli.terminal.guard import guarded


def become(request: dict) -> None:
    """What an interpreter that was started for this would find."""
    os.chdir(request["folder"])
    signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever started the tests may have it ignored
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    for number in request["ignore"]:
        signal.signal(number, signal.SIG_IGN)
    out, err = (os.open(f"{os.getpid()}.{name}", os.O_WRONLY | os.O_CREAT) for name in ("out", "err"))
    if request["pipe"]:
        reader, out = os.pipe()
        os.close(reader)
    for target, source in enumerate((os.open(os.devnull, os.O_RDONLY), out, err)):
        os.dup2(source, target)


def serve() -> list[str]:
    """Answers until the requests end, and then as a child with the words of its command."""
    for line in sys.stdin:
        request = json.loads(line)
        if "wait" in request:
            number, status = os.waitpid(request["wait"], os.WNOHANG)
            print(json.dumps(os.waitstatus_to_exitcode(status) if number else None), flush=True)
            continue
        number = os.fork()
        if number == 0:
            become(request)
            return request["argv"]
        print(json.dumps(number), flush=True)
    sys.exit(0)


if __name__ == "__main__":
    answers, sys.stdout = sys.stdout, open(os.devnull, "w")  # noqa: SIM115
    with tempfile.TemporaryDirectory() as folder:
        for method, words in (("mean", []), ("rkhs", ["--real-time"])):
            log = os.path.join(folder, f"{method}.mcap")
            main(["run", "crossing1", "--controller", method, "--log", log, "--set", "time_limit=0.3", *words])
    sys.stdout = answers
    print(json.dumps("ready"), flush=True)
    words = serve()
    sys.exit(guarded(lambda guard: main(words, guard=guard)))
