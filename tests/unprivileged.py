"""Runs a command as a process that Linux grants nothing for real time: no SCHED_FIFO, memory locked to a limit only.

    python tests/unprivileged.py LIMIT COMMAND...

LIMIT is RLIMIT_MEMLOCK [bytes], as far as this process may raise it. Root keeps its name, and so its files, but loses
the capabilities.
"""

import ctypes
import os
import resource
import sys

PR_CAPBSET_DROP = 24  # from <linux/prctl.h>; what is not in the bounding set, root does not get back in exec
CAPABILITIES = (14, 23, 24)  # IPC_LOCK, SYS_NICE, SYS_RESOURCE, from <linux/capability.h>


def main() -> None:
    limit, command = int(sys.argv[1]), sys.argv[2:]
    resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
    hard = resource.getrlimit(resource.RLIMIT_MEMLOCK)[1]
    try:
        resource.setrlimit(resource.RLIMIT_MEMLOCK, (limit, limit))
    except ValueError:  # beyond the hard limit
        resource.setrlimit(resource.RLIMIT_MEMLOCK, (hard, hard))
    if os.geteuid() == 0:
        libc = ctypes.CDLL(None)
        for capability in CAPABILITIES:
            libc.prctl(PR_CAPBSET_DROP, capability, 0, 0, 0)
    os.execvp(command[0], command)


if __name__ == "__main__":
    main()
