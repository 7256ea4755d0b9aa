"""forked_readers.py: runs `mjnav` commands in processes of their own, forked from one that has everything loaded.

Reads a request a line, {"argv": [...], "folder": path, "memory": bytes}, and answers with a line: the exit code, what
was said on standard error, the bytes by which the process grew at most, and its processor time [s]. JSON both.
"""

import json
import os
import resource
import sys
import tempfile

from mjnav.cli.main import main


def statm(field: int) -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[field]) * resource.getpagesize()


def run(request: dict) -> int:
    os.chdir(request["folder"])
    resource.setrlimit(resource.RLIMIT_AS, (statm(0) + request["memory"],) * 2)
    return main(request["argv"])


def serve() -> None:
    for line in sys.stdin:
        request = json.loads(line)
        with tempfile.TemporaryFile() as err:
            number = os.fork()
            if number == 0:
                os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
                os.dup2(err.fileno(), 2)
                code = 70  # of whatever is no exit code of mjnav's
                try:
                    code = run(request)
                finally:
                    sys.stderr.flush()
                    os._exit(code)
            _, status, used = os.wait4(number, 0)
            err.seek(0)
            said = err.read().decode(errors="replace")
        answer = {
            "code": os.waitstatus_to_exitcode(status),
            "err": said,
            "grown": 1024 * used.ru_maxrss - statm(1),
            "seconds": used.ru_utime + used.ru_stime,
        }
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    log, folder = sys.argv[1:]
    for words in (["inspect"], ["report", "-o", f"{folder}/a.html"], ["export", f"{folder}/b", "--format", "csv"]):
        main([words[0], log, *words[1:]])  # loads what these commands use
    serve()
