"""Starts a firmware: `python launcher.py LINK own|shared PROGRAM ...`; a standalone script.

It enters a network namespace if asked to and possible, and writes why not to LINK, a Unix socket.
Once its parent has answered there, it opens the sockets of `SOCKETS`, passes them to its parent and
becomes the firmware, which is killed with the thread that started it.
"""

import contextlib
import ctypes
import fcntl
import os
import signal
import socket
import struct
import sys

NEW_USER, NEW_NET = 0x10000000, 0x40000000
"""Flags of unshare(2)."""
STATE_PORT, RC_PORT, ROTOR_PORT, CLI_PORT = 9003, 9004, 9002, 5761
"""UDP into the firmware: state, RC channels; UDP out of it: rotors; TCP: its command line."""
_DIE_WITH_PARENT = 1
_GET_FLAGS, _SET_FLAGS, _UP = 0x8913, 0x8914, 0x1


def isolate() -> str:
    """Enter a new network namespace and bring its loopback up; return the error, if any."""
    if not sys.platform.startswith("linux"):
        return f"{sys.platform} has no network namespaces"
    libc = ctypes.CDLL(None, use_errno=True)
    user, group = os.getuid(), os.getgid()
    if libc.unshare(NEW_NET):
        if libc.unshare(NEW_USER | NEW_NET):
            return f"unshare: {os.strerror(ctypes.get_errno())}"
        _keep_ids(user, group)
    try:
        _bring_up("lo")
    except OSError as error:
        return f"loopback: {error}"
    return ""


def _keep_ids(user: int, group: int) -> None:
    """Map the user to itself in the new namespace, so that files keep their owner."""
    values = {"setgroups": "deny", "uid_map": f"{user} {user} 1", "gid_map": f"{group} {group} 1"}
    for name, value in values.items():
        with contextlib.suppress(OSError), open(f"/proc/self/{name}", "w") as file:
            file.write(value)  # without the mapping the user is "nobody", which suffices


def _bring_up(interface: str) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        name = interface.encode()
        answer = fcntl.ioctl(sock, _GET_FLAGS, struct.pack("16sH14x", name, 0))
        (flags,) = struct.unpack_from("H", answer, 16)
        fcntl.ioctl(sock, _SET_FLAGS, struct.pack("16sH14x", name, flags | _UP))


def open_sockets() -> list[socket.socket]:
    """Open sockets: of the rotors, the state, the RC channels, and one to connect by TCP."""
    rotors, state, sticks = (socket.socket(type=socket.SOCK_DGRAM) for _ in range(3))
    rotors.bind(("127.0.0.1", ROTOR_PORT))
    state.connect(("127.0.0.1", STATE_PORT))
    sticks.connect(("127.0.0.1", RC_PORT))
    return [rotors, state, sticks, socket.socket()]


def main() -> None:
    """See the module."""
    _, descriptor, network, *program = sys.argv
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)
    with socket.socket(fileno=int(descriptor)) as link:
        link.sendall((isolate() if network == "own" else "not requested").encode() + b"\n")
        if not link.recv(1):
            return
        sockets = open_sockets()
        socket.send_fds(link, [b"\n"], [sock.fileno() for sock in sockets])
    os.execv(program[0], program)


if __name__ == "__main__":
    main()
