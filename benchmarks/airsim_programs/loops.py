"""Programs that control time or loop over actions: pauses, reinforcement learning."""

import importlib.util
import itertools
import time
from pathlib import Path
from typing import Any

from benchmarks.airsim_programs.program import Near, program
from benchmarks.airsim_programs.session import Session

Found = dict[str, Any]
_CHAPTER = Path(__file__).parents[2] / "examples" / "airsim_chapter.py"
_MOVES = ((1, 0), (0, -1), (0, 1))


@program(
    since="airsim-1.2", paused=[True, False], stood=Near(0.0, 1e-9), seconds=Near([2.0, 10.0], 0.02)
)
def pauses(s: Session) -> Found:
    """Pause while the program sleeps; 200 times 0.01 s are 2 s, 200 times 0.05 s are 10 s."""
    s.take_off()
    s.client.simPause(True)
    paused, begin = [s.client.simIsPause()], s.seconds()
    time.sleep(0.1)
    stood, seconds = s.seconds() - begin, []
    for step in (0.01, 0.05):
        begin = s.seconds()
        for _ in range(200):
            s.client.simContinueForTime(step)
        seconds.append(s.seconds() - begin)
    s.client.simPause(False)
    return {"paused": [*paused, s.client.simIsPause()], "stood": stood, "seconds": seconds}


@program(since="airsim", seconds=Near([0.21, 2.1], 0.003), paused=True)
def frames(s: Session) -> Found:
    """Continue for 10 and for 100 frames of 21 ms."""
    s.client.simPause(True)
    times = [s.seconds()]
    for count in (10, 100):
        s.client.simContinueForFrames(count)
        times.append(s.seconds())
    seconds = [after - before for before, after in itertools.pairwise(times)]
    return {"seconds": seconds, "paused": s.client.simIsPause()}


@program(since="airsim-1.2", options={"clock": "wall"}, moved=Near(2.0, 1.0), passed=Near(1.5, 0.4))
def sleep_while_flying(s: Session) -> Found:
    """Start a movement at 2 m/s, and sleep for 1.5 s of the wall clock: 3 m less 0.9 s of lag."""
    s.put(s.pose(0, 0, -5))
    s.client.enableApiControl(True)
    s.client.armDisarm(True)
    begin, start = s.seconds(), s.place()[0]
    s.client.moveByVelocityAsync(2, 0, 0, 3)
    time.sleep(1.5)
    return {"moved": s.place()[0] - start, "passed": s.seconds() - begin}


class _Environment:
    """A drone that flies by three actions; the observation is the front camera's image."""

    def __init__(self, s: Session) -> None:
        self.s = s

    def reset(self) -> tuple[Any, dict[str, Any]]:
        """Return to the start and climb."""
        self.s.client.reset()
        self.s.take_off()
        return self.s.colors(), {}

    def step(self, action: int) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Fly for 0.25 s; the reward is the distance northwards, a collision ends the episode."""
        vx, vy = _MOVES[action]
        before = self.s.place()[0]
        self.s.fly("moveByVelocityZ", 2 * vx, 2 * vy, -2, 0.25)
        reward, collided = self.s.place()[0] - before, bool(self.s.collision().has_collided)
        return self.s.colors(), reward, collided, False, {}


@program(episodes=3, steps=120, shapes=1, returns=Near([18.2] * 3, 0.6))
def environment(s: Session) -> Found:
    """Wrap the client as an environment: 40 steps of 0.25 s at 2 m/s, with a lag of 0.9 s."""
    env, steps, shapes, returns = _Environment(s), 0, set(), []
    for _ in range(3):
        observation, _ = env.reset()
        total = 0.0
        for _ in range(40):
            observation, reward, terminated, truncated, _ = env.step(0)
            steps, total = steps + 1, total + reward
            shapes.add(observation.shape)
            if terminated or truncated:
                break
        returns.append(total)
    return {"episodes": len(returns), "steps": steps, "shapes": len(shapes), "returns": returns}


@program(
    settings='{"ViewMode": "NoDisplay"}',
    options={"scene": "blocks"},
    steps=200,
    seconds=Near(50.0, 1.3),
    collisions=True,
)
def dqn(s: Session) -> Found:
    """Act 200 times for 0.25 s by states only; a collision begins a new episode."""
    s.take_off()
    number, collisions, seconds = 1, 0, 0.0
    for _ in range(200):
        number = number * 48271 % (2**31 - 1)  # random actions, the same on all machines
        vx, vy = ((2, 0), (3, 0), (2, 1), (2, -1))[number % 4]
        begin = s.seconds()
        s.fly("moveByVelocityZ", vx, vy, -2, 0.25)
        seconds += s.seconds() - begin
        if s.collision().has_collided:
            collisions += 1
            s.client.reset()
            s.take_off()
            s.collision()
    return {"steps": 200, "seconds": seconds, "collisions": collisions > 3}


_CHAPTER_SETTINGS = """{"SettingsVersion": 1, "CameraDefaults": {"CaptureSettings": [
  {"ImageType": 0, "Width": 64, "Height": 25, "FOV_Degrees": 135}]}, %s
  "Vehicles": {"Drone": {"VehicleType": "SimpleFlight", "X": 0, "Y": 0, "Z": %g}}}"""


def _chapter(s: Session) -> Found:
    """Fly five episodes of the chapter's program by its oracle, which collects all three cubes."""
    spec: Any = importlib.util.spec_from_file_location(_CHAPTER.stem, _CHAPTER)
    example: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    cubes = example.fly(example.ChapterEnv(s.client), example.oracle, 5)
    return {"cubes": sum(cubes) / len(cubes)}


for _name, _clock, _mode, _z in (
    ("chapter_wall", "wall", "", -2.2),
    ("chapter_lockstep", "lockstep", "", -2.2),
    ("chapter_computer_vision", "wall", '"SimMode": "ComputerVision",', 0.0),
):
    program(
        _name,
        until="AirSimClient",
        settings=_CHAPTER_SETTINGS % (_mode, _z),
        options={"scene": "cubes", "clock": _clock},
        cubes=Near(3.0, 0.1),
    )(_chapter)
