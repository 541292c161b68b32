"""Supervisor process of a firmware; a standalone script that imports nothing of drone_rl.

It optionally enters a network namespace, starts the firmware in it, opens sockets there and passes
them to its parent. It ends the firmware on request, or when its parent is gone for any reason.
Requests and replies are lines of JSON over a Unix socket.
"""

import contextlib
import ctypes
import fcntl
import json
import os
import signal
import socket
import struct
import subprocess
import sys
from typing import IO, Any

NEW_USER, NEW_NET = 0x10000000, 0x40000000
"""Flags of unshare(2)."""
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


def _die_with_parent() -> None:
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)


class Supervisor:
    """Starts, polls and stops one firmware."""

    def __init__(self) -> None:
        """Create a supervisor without a firmware."""
        self.firmware: subprocess.Popen[bytes] | None = None

    def start(self, program: list[str], folder: str, log: str) -> dict[str, Any]:
        """Start the firmware, after stopping the previous one."""
        self.stop()
        with open(log, "ab") as file:
            self.firmware = subprocess.Popen(
                program,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
                preexec_fn=_die_with_parent,
            )
        return {"pid": self.firmware.pid}

    def poll(self) -> dict[str, Any]:
        """Return the firmware's exit status: None while it runs, 0 before the first start."""
        return {"status": self.firmware.poll() if self.firmware else 0}

    def stop(self) -> dict[str, Any]:
        """Stop the firmware."""
        if self.firmware and self.firmware.poll() is None:
            self.firmware.terminate()
            try:
                self.firmware.wait(1.0)
            except subprocess.TimeoutExpired:
                self.firmware.kill()
                self.firmware.wait()
        return {}


def make_socket(kind: str, port: int) -> socket.socket:
    """Open a socket on loopback.

    Args:
        kind: "bound" (receives from a UDP port), "udp" (sends to one) or "tcp" (connected to one).
        port: Port number.
    """
    sock = socket.socket(type=socket.SOCK_STREAM if kind == "tcp" else socket.SOCK_DGRAM)
    try:
        sock.settimeout(1.0)
        (sock.bind if kind == "bound" else sock.connect)(("127.0.0.1", port))
    except BaseException:
        sock.close()
        raise
    return sock


def serve(link: socket.socket, lines: IO[bytes]) -> None:
    """Answer requests until the input ends; then stop the firmware."""
    supervisor = Supervisor()
    try:
        for line in lines:
            request = json.loads(line)
            sockets, reply = [], {}
            try:
                name = request.pop("request")
                if name == "connect":
                    sockets = [make_socket(**request)]
                else:
                    reply = getattr(supervisor, name)(**request)
            except OSError as error:
                reply = {"error": str(error)}
            text = json.dumps(reply).encode() + b"\n"
            socket.send_fds(link, [text], [sock.fileno() for sock in sockets])
            for sock in sockets:
                sock.close()
    finally:
        supervisor.stop()


def main() -> None:
    """Run as `python supervisor.py DESCRIPTOR own|shared`."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this process
    with socket.socket(fileno=int(sys.argv[1])) as link, link.makefile("rb") as lines:
        why = isolate() if sys.argv[2] == "own" else "not requested"
        link.sendall(json.dumps({"shared": why}).encode() + b"\n")
        serve(link, lines)


if __name__ == "__main__":
    main()
