"""The supervisor alone, as a program."""

import json
import socket
import subprocess
import sys
import time
from pathlib import Path

from drone_rl.flight.betaflight import supervisor


def started(where):
    ours, theirs = socket.socketpair()
    ours.settimeout(10.0)
    with theirs:
        command = [sys.executable, "-I", supervisor.__file__, str(theirs.fileno()), where]
        process = subprocess.Popen(command, pass_fds=[theirs.fileno()])
    lines = ours.makefile("rb")
    return ours, lines, process, json.loads(lines.readline())


def ask(ours, lines, **request):
    ours.sendall(json.dumps(request).encode() + b"\n")
    return json.loads(lines.readline())


def is_there(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def test_what_it_keeps_ends_with_who_started_it(tmp_path):
    ours, lines, process, greeting = started("shared")
    assert greeting == {"shared": "not requested"}
    program = [sys.executable, "-c", "import time; time.sleep(60)"]
    told = {"program": program, "folder": str(tmp_path), "log": str(tmp_path / "log")}
    pid = ask(ours, lines, request="start", **told)["pid"]
    assert is_there(pid)
    assert ask(ours, lines, request="poll") == {"status": None}
    lines.close()
    ours.close()  # as when our process is killed
    assert process.wait(10.0) == 0
    assert not is_there(pid)


def test_what_it_keeps_ends_when_it_is_killed(tmp_path):
    ours, lines, process, _ = started("shared")
    program = [sys.executable, "-c", "import time; time.sleep(60)"]
    told = {"program": program, "folder": str(tmp_path), "log": str(tmp_path / "log")}
    pid = ask(ours, lines, request="start", **told)["pid"]
    process.kill()
    process.wait()
    end = time.monotonic() + 10.0
    while is_there(pid) and time.monotonic() < end:
        time.sleep(0.01)
    assert not is_there(pid) or not sys.platform.startswith("linux")
    lines.close()
    ours.close()


def test_a_stubborn_firmware_is_killed(tmp_path):
    code = "import signal, time; signal.signal(15, signal.SIG_IGN); print(1, flush=True); "
    code += "time.sleep(60)"
    kept, log = supervisor.Supervisor(), tmp_path / "log"
    pid = kept.start([sys.executable, "-c", code], str(tmp_path), str(log))["pid"]
    while not log.read_bytes():
        time.sleep(0.01)
    kept.stop()
    assert not is_there(pid)
    assert kept.poll() == {"status": -9}


def test_a_network_of_its_own_is_another(own_network):
    """Two in networks of their own have the same port at the same time; ours stays free."""
    both = [started("own") for _ in range(2)]
    for ours, lines, _, _ in both:
        assert ask(ours, lines, request="connect", kind="bound", port=9002) == {}
    for ours, lines, process, _ in both:
        lines.close()
        ours.close()
        assert process.wait(10.0) == 0


def test_sockets_of_each_kind():
    with supervisor.make_socket("bound", 0) as hears:
        assert hears.type == socket.SOCK_DGRAM and hears.gettimeout() == 1.0
        with supervisor.make_socket("udp", hears.getsockname()[1]) as sends:
            assert sends.type == socket.SOCK_DGRAM
            sends.send(b"here")
            assert hears.recv(16) == b"here"
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        supervisor.make_socket("tcp", server.getsockname()[1]) as sends,
    ):
        assert sends.type == socket.SOCK_STREAM
