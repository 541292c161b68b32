"""A program of its own that keeps a firmware: run by its path, it knows nothing of drone_rl.

It enters a network namespace of its own, if asked to; starts the firmware in it; makes sockets
there and hands them out; and ends the firmware when it is told to, or when whoever started it is
gone, however that came about. Requests and replies are lines of JSON over a Unix socket.
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
    """Enters a network namespace of this process's own, whose loopback is up.

    Returns:
        Empty, or why that can't be.
    """
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
    """Files in a new user's namespace go on belonging to who we are."""
    values = {"setgroups": "deny", "uid_map": f"{user} {user} 1", "gid_map": f"{group} {group} 1"}
    for name, value in values.items():
        with contextlib.suppress(OSError), open(f"/proc/self/{name}", "w") as file:
            file.write(value)  # where that can't be, we are nobody, who can do all that is needed


def _bring_up(interface: str) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        name = interface.encode()
        answer = fcntl.ioctl(sock, _GET_FLAGS, struct.pack("16sH14x", name, 0))
        (flags,) = struct.unpack_from("H", answer, 16)
        fcntl.ioctl(sock, _SET_FLAGS, struct.pack("16sH14x", name, flags | _UP))


def _die_with_parent() -> None:
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)


class Keeper:
    """Answers requests about one firmware."""

    def __init__(self) -> None:
        """Nothing runs yet."""
        self.firmware: subprocess.Popen[bytes] | None = None

    def start(self, program: list[str], folder: str, log: str) -> dict[str, Any]:
        """Starts the firmware; the one before must have ended."""
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
        """The firmware's exit status; none while it runs."""
        return {"status": self.firmware.poll() if self.firmware else 0}

    def stop(self) -> dict[str, Any]:
        """Ends the firmware."""
        if self.firmware and self.firmware.poll() is None:
            self.firmware.terminate()
            try:
                self.firmware.wait(1.0)
            except subprocess.TimeoutExpired:
                self.firmware.kill()
                self.firmware.wait()
        return {}


def make_socket(kind: str, port: int) -> socket.socket:
    """A socket on loopback.

    Args:
        kind: "bound", which hears what is sent to a UDP port; "udp", which sends to one; or "tcp",
            which is connected to one.
        port: Which.
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
    """Answers until nobody asks any more; then the firmware is ended."""
    keeper = Keeper()
    try:
        for line in lines:
            request = json.loads(line)
            given, reply = [], {}
            try:
                name = request.pop("request")
                if name == "socket":
                    given = [make_socket(**request)]
                else:
                    reply = getattr(keeper, name)(**request)
            except OSError as error:
                reply = {"error": str(error)}
            text = json.dumps(reply).encode() + b"\n"
            socket.send_fds(link, [text], [sock.fileno() for sock in given])
            for sock in given:
                sock.close()
    finally:
        keeper.stop()


def main() -> None:
    """Run as `python keeper.py DESCRIPTOR own|shared`."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who started it will end it
    with socket.socket(fileno=int(sys.argv[1])) as link, link.makefile("rb") as lines:
        why = isolate() if sys.argv[2] == "own" else "not asked for"
        link.sendall(json.dumps({"shared": why}).encode() + b"\n")
        serve(link, lines)


if __name__ == "__main__":
    main()
