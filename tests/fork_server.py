"""A process that imports the package once and runs each program in a fork of itself.

Imports take most of the time of a short program. Like a process that a shell starts, a fork has its
own arguments, folder, streams, limits and exit status.
"""

import gc
import importlib
import json
import os
import socket
import sys

from drone_rl.cli.main import COMMANDS
from drone_rl.utils.unloaded_compiler import leave_compiler_unloaded

_MORE = (
    *("cli.hydra.messages", "cli.hydra.help", "training.train", "trust.export"),
    *("trust.evaluate", "trust.video"),
)


def _serve(connection):
    """Fork for each request; return the request in the fork, and None after the last one."""
    while True:
        data, streams, *_ = socket.recv_fds(connection, 2**16, 2)
        if not data:
            return None
        child = os.fork()
        if not child:
            os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
            for number, stream in enumerate(streams, 1):
                os.dup2(stream, number)
                os.close(stream)
            connection.close()
            return json.loads(data)
        for stream in streams:
            os.close(stream)
        _, status = os.waitpid(child, 0)
        connection.send(str(os.waitstatus_to_exitcode(status)).encode())


if __name__ == "__main__":
    leave_compiler_unloaded()
    for name in (*(f"cli.{command}" for command in {*COMMANDS.values()}), *_MORE):
        importlib.import_module(f"drone_rl.{name}")
    importlib.import_module("hydra.core.plugins").Plugins.instance()  # scans all packages
    gc.freeze()  # forks then copy fewer pages
    request = _serve(socket.socket(fileno=int(sys.argv[1])))
    if request is not None:
        os.environ.update(request["environment"])
        os.chdir(request["cwd"])
        sys.path[0] = request["cwd"]
        sys.argv = ["-c", *request["args"]]
        exec(compile(request["code"], "<string>", "exec"), {"__name__": "__main__"})
