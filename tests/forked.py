"""Run programs in processes that have imported the package already, see fork_server.py."""

import json
import os
import socket
import subprocess
import sys
import threading
from pathlib import Path

_servers = []


class _Server:
    """A process of fork_server.py and the connection to it."""

    def __init__(self):
        self.connection, theirs = socket.socketpair()
        self.connection.settimeout(300)
        program = Path(__file__).with_name("fork_server.py")
        command = [sys.executable, str(program), str(theirs.fileno())]
        self.process = subprocess.Popen(command, pass_fds=[theirs.fileno()])
        theirs.close()

    def run(self, request, streams):
        """Run a program with these streams for output and errors; return its exit status."""
        socket.send_fds(self.connection, [json.dumps(request).encode()], streams)
        return int(self.connection.recv(16))


def run_forked(code, *args, cwd, stdout=None, environment=None):
    """Run Python code as `python -c` does; `stdout` is a file descriptor to print to.

    `environment` has the variables that may differ from those of this process.
    """
    if not _servers:
        _servers.append(_Server())
    changed = dict(set((environment or {}).items()) - set(os.environ.items()))
    request = {"code": code, "args": [*map(str, args)], "cwd": str(cwd), "environment": changed}
    streams, readers, printed = [], [], {}
    for name in ("stdout", "stderr"):
        if name == "stdout" and stdout is not None:
            streams.append(os.dup(stdout))
            continue
        reader, writer = os.pipe()
        streams.append(writer)
        readers.append(threading.Thread(target=_read, args=(printed, name, reader)))
        readers[-1].start()
    try:
        status = _servers[0].run(request, streams)
    finally:
        for stream in streams:
            os.close(stream)
    for reader in readers:
        reader.join()
    return subprocess.CompletedProcess(args, status, printed.get("stdout"), printed["stderr"])


def _read(printed, name, reader):
    with open(reader) as stream:
        printed[name] = stream.read()


def stop_servers():
    """End the process that forks."""
    while _servers:
        server = _servers.pop()
        server.connection.close()
        server.process.wait()
