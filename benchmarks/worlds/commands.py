"""What works on a scene that nobody has seen before, without Python by its author."""

import json
import math
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import msgpack

from benchmarks.benchmark import Setup
from benchmarks.commands import PROGRAM, call
from benchmarks.seeing import STATUSES
from benchmarks.worlds.training import WALKING, task_in
from drone_rl.utils.files import read_json

_HERE = Path(__file__).parent
_ROOT = _HERE.parents[1]
SCENE = "my_house.xml"
_PROGRAMS = {
    "Gymnasium": "gymnasium_program.py",
    "SB3": "sb3_program.py",
    "dm_control": "dm_control_program.py",
}
_WALL = 3.0
"""x of the inner wall, metres; vehicles of `serve` start at the origin."""


def bench_world_commands(setup: Setup) -> dict[str, Any]:
    """Run every command, and programs of three libraries, on a scene that is written here.

    Returns:
        "world_commands", those that work, of "world_commands_total"; "world_commands_failing", why
        the others do not, by name.
    """
    with tempfile.TemporaryDirectory() as folder:
        own = Path(folder)
        write_house(own / SCENE)
        for name in _PROGRAMS.values():
            shutil.copy(_HERE / name, own)
        works = run_commands(own, setup.quick)
    return {
        "world_commands": sum(why is None for why in works.values()),
        "world_commands_total": len(works),
        "world_commands_failing": {name: why for name, why in works.items() if why is not None},
    }


def write_house(path: Path) -> None:
    """Write a house of two rooms and a doorway between them, 6 x 4 m, around (3, 0)."""
    boxes = {
        "floor": ("2.25 0 -0.05", "3.85 2.1 0.05", "0.6 0.5 0.4"),
        "west": ("-1.55 0 1.2", "0.05 2.1 1.2", "0.8 0.7 0.5"),
        "east": ("6.05 0 1.2", "0.05 2.1 1.2", "0.5 0.6 0.8"),
        "south": ("2.25 -2.05 1.2", "3.85 0.05 1.2", "0.7 0.7 0.7"),
        "north": ("2.25 2.05 1.2", "3.85 0.05 1.2", "0.6 0.7 0.6"),
        "inner_south": (f"{_WALL} -0.6 1.2", "0.05 1.4 1.2", "0.8 0.4 0.3"),
        "inner_north": (f"{_WALL} 1.95 1.2", "0.05 0.05 1.2", "0.8 0.4 0.3"),
        "table": ("4.8 -1.2 0.4", "0.5 0.5 0.4", "0.4 0.25 0.1"),
    }
    geoms = "".join(
        f'    <geom name="{name}" type="box" pos="{pos}" size="{size}" rgba="{color} 1"/>\n'
        for name, (pos, size, color) in boxes.items()
    )
    path.write_text(
        '<mujoco model="my_house">\n  <worldbody>\n'
        '    <light type="directional" dir="0.3 0.4 -1" castshadow="false"/>\n'
        f"{geoms}"
        '    <site name="start" type="box" pos="0.7 0 1.2" size="1.7 1.4 0.2"/>\n'
        '    <site name="goal" pos="5 1 1.2"/>\n'
        "  </worldbody>\n</mujoco>\n"
    )


def run_commands(own: Path, quick: bool) -> dict[str, str | None]:
    """Run all commands in a folder that holds `SCENE`; return why those that fail do, by name."""
    few = ["frames=100", "perplexity=10", "episodes=50"] if quick else []
    policy = f"policy={own / 'train'}"
    frames = 150_000 if quick else 400_000

    def has(*names: str) -> Callable[[Path], bool]:
        return lambda made: all(any(made.rglob(name)) for name in names)

    checks: dict[str, tuple[list[str], Callable[[Path], bool]]] = {
        "train": (
            [*task_in(SCENE), *WALKING, "logger=csv", f"trainer.total_frames={frames}"],
            has("result.json", "last.pt"),
        ),
        "evaluate": ([policy, "episodes=100"], has("evaluation.json", "episode_0.mp4")),
        "verdict": ([policy, "episodes=100"], has("verdict.json")),
        "shifts": ([policy, "axes=[light]", "episodes=50"], has("shifts.png", "shifts.json")),
        "bodies": ([policy.replace("policy=", "policies=[") + "]", "episodes=50"], has("*.json")),
        "explain": ([policy, *few], _is_explained),
        "class-models": ([policy], has("class_models.png", "class_models.json")),
        "play": ([policy, "episodes=1"], has("episode_0.mp4")),
        "export": ([policy, "format=onnx", "episodes=100"], has("*.onnx")),
    }
    works: dict[str, str | None] = {}
    for name, (args, is_right) in checks.items():
        works[name] = _why_not(partial(_run, own, name, args, is_right))
    works["fly"] = _why_not(partial(_fly, own, policy))
    works["serve"] = _why_not(partial(_serve, own))
    return works | {name: _why_not(partial(_program, own, p)) for name, p in _PROGRAMS.items()}


def _why_not(work: Callable[[], None]) -> str | None:
    try:
        work()
    except (RuntimeError, OSError, ValueError, subprocess.SubprocessError) as error:
        return str(error)
    return None


def _run(own: Path, name: str, args: list[str], is_right: Callable[[Path], bool]) -> None:
    made = own / name
    call(name, *args, f"hydra.run.dir={made}", statuses=STATUSES, folder=own)
    if not is_right(made):
        raise RuntimeError("its output lacks something")


def _is_explained(made: Path) -> bool:
    """Whether there is a report, heat maps were tested and class models made."""
    (path,) = made.rglob("explanation.json")
    found = read_json(path)
    has_report = any(made.rglob("report.html"))
    return has_report and all(found.get(name) for name in ("attribution", "class_model"))


@contextmanager
def _server(own: Path, *args: str, line: str) -> Iterator[str]:
    """Run a command that runs until Ctrl-C; provide what a line that it prints has in a group."""
    process = subprocess.Popen(
        [*PROGRAM, *args],
        cwd=own,
        env={**os.environ, "PYTHONPATH": str(_ROOT), "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # shells let programs in the background ignore Ctrl-C
        preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),
    )
    assert process.stdout is not None and process.stderr is not None
    try:
        found = None
        while found is None:
            printed = process.stdout.readline()
            if not printed:
                raise RuntimeError(process.stderr.read()[-500:])
            found = re.search(line, printed)
        yield found[1]
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=120)
        if process.returncode:
            raise RuntimeError(f"status {process.returncode} after Ctrl-C: {errors[-500:]}")
    finally:
        process.kill()
        process.wait()


def _fly(own: Path, policy: str) -> None:
    settings = ("fly", policy, "browser=false", "saliency=false")
    with (
        _server(own, *settings, line=r"open (http://\S+)") as url,
        urllib.request.urlopen(url, timeout=120) as answer,
    ):
        answer.read()


def _serve(own: Path) -> None:
    """Fly into the inner wall, by AirSim's commands: the vehicle must touch it and stay before."""
    settings = ("serve", f"scene={SCENE}", "settings=none", "port=0", "clock=lockstep")
    with _server(own, *settings, line=r"127\.0\.0\.1:(\d+)") as port:
        ask = _Client(int(port))
        ask("enableApiControl", True, "")
        ask("takeoff", 20.0, "")
        yaw = {"is_rate": True, "yaw_or_rate": 0.0}
        ask("moveByVelocity", 1.0, 0.0, 0.0, 6.0, 0, yaw, "")
        x = ask("simGetVehiclePose", "")["position"]["x_val"]
        touched = ask("simGetCollisionInfo", "")["has_collided"]
        ask.close()
    if math.isnan(x) or x > _WALL or not touched:
        raise RuntimeError(f"the vehicle is at x={x:.2f} m, touched={touched}, behind the wall")


class _Client:
    """Calls by msgpack-rpc."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), timeout=120)
        self._unpacker = msgpack.Unpacker(raw=False, strict_map_key=False)

    def __call__(self, method: str, *args: Any) -> Any:
        self._socket.sendall(msgpack.packb([0, 1, method, args]) or b"")
        while data := self._socket.recv(2**16):
            self._unpacker.feed(data)
            for _, _, error, result in self._unpacker:
                if error is not None:
                    raise RuntimeError(f"{method}: {error}")
                return result
        raise RuntimeError(f"{method}: the server has closed the connection")

    def close(self) -> None:
        self._socket.close()


def _program(own: Path, name: str) -> None:
    """Run a Python program with the scene's path; it must count episodes that end."""
    process = subprocess.run(
        [sys.executable, name, SCENE],
        capture_output=True,
        text=True,
        check=False,
        cwd=own,
        env={**os.environ, "PYTHONPATH": str(_ROOT)},
    )
    if process.returncode:
        raise RuntimeError(process.stderr.strip()[-500:])
    if not json.loads(process.stdout.splitlines()[-1])["episodes"]:
        raise RuntimeError("no episodes")
