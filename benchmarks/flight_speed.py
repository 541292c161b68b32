# pyright: reportAttributeAccessIssue=false
# pyright: reportCallIssue=false
# (MuJoCo Warp's and Warp's functions are untyped.)
"""Speed of the quadrotor simulation: a batch, compared with MuJoCo Warp, and one camera drone."""

from functools import partial
from typing import Any

import mujoco
import mujoco_warp as mjw
import torch
import warp as wp

from benchmarks.benchmark import Setup
from benchmarks.pipeline import default_collector, paired, rate
from drone_rl.config import CameraSettings, DynamicsSettings
from drone_rl.sim.dynamics import FlightState, Quadrotor
from drone_rl.sim.worlds import Worlds

FLYING = DynamicsSettings(mode="simple_flight")
_DRONES = 256
_COLLECTED = (64, 256)
"""Batch sizes at which the collector is measured."""
_FREE_BODY = """
<mujoco>
  <option timestep="{tick}" integrator="Euler"/>
  <worldbody>
    <body pos="0 0 2.5">
      <freejoint/>
      <inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia}"/>
      <geom type="sphere" size="0.3" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
</mujoco>
"""


def bench_flight_speed(setup: Setup) -> dict[str, Any]:
    """Measure the quadrotor simulation on all cores.

    Returns:
        "flight_moves_per_s": moves per second of 256 drones together; a move has 33 ticks with the
        whole control cascade. "flight_over_mujoco_warp": ratio to MuJoCo Warp's moves per second
        of the same body without controllers. "flight_realtime_factor": simulated seconds per
        second of one drone whose front camera renders 144x256 pixels at each command, about ten
        times per second. "flight_over_cv": frames per second of the collector with vehicle dynamics
        divided by those in computer-vision mode, each at its best batch size;
        "flight_collector_fps": the former.
    """
    seconds = 0.2 if setup.quick else 3.0
    fly, step = partial(_fly, Fleet(_DRONES)), _mujoco_warp_step(_DRONES)
    fly()
    step()
    moves, _, ratio = paired(fly, step, seconds=seconds, rounds=5)
    collected, over_cv = _collecting(seconds)
    return {
        "flight_moves_per_s": moves,
        "flight_over_mujoco_warp": ratio,
        "flight_realtime_factor": _realtime(seconds),
        "flight_over_cv": over_cv,
        "flight_collector_fps": collected,
    }


class Fleet:
    """A batch of drones that take random moves."""

    def __init__(self, count: int) -> None:
        """Start the drones in the air."""
        self.quadrotor = Quadrotor(FLYING)
        self.body: FlightState = self.quadrotor.start(
            torch.tensor([[0.0, 0.0, 2.5]], dtype=torch.float64).repeat(count, 1)
        )
        self.actions = torch.randint(3, (64, count), generator=torch.Generator().manual_seed(0))


def _fly(fleet: Fleet) -> int:
    """Take 64 moves with every drone; return the number of moves."""
    for action in fleet.actions:
        fleet.body = fleet.quadrotor.step(fleet.body, action)
    return fleet.actions.numel()


def _mujoco_warp_step(count: int) -> Any:
    """Return a function that takes one move of each drone in MuJoCo Warp, without controllers."""
    text = _FREE_BODY.format(
        tick=FLYING.tick, mass=FLYING.mass, inertia=" ".join(map(str, FLYING.inertia))
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    with wp.ScopedDevice("cpu"):
        warp_model = mjw.put_model(model)
        warp_data = mjw.put_data(model, data, nworld=count)
        mjw.step(warp_model, warp_data)  # compiles
        with wp.ScopedCapture() as capture:
            mjw.step(warp_model, warp_data)
    graph = capture.graph
    assert graph is not None  # capture works on CPUs, too

    def step() -> int:
        for _ in range(FLYING.control_ticks):
            wp.capture_launch(graph)
        return count

    return step


def _realtime(seconds: float) -> float:
    """Return the simulated seconds per second of a drone with a camera."""
    worlds = Worlds(1, camera=CameraSettings(width=256, height=144), dynamics=Quadrotor(FLYING))
    worlds.prepare()
    envs, action = torch.arange(1), torch.zeros(1, dtype=torch.int64)

    def move() -> int:
        worlds.step(envs, action)
        worlds.render(worlds.state)
        return 1

    move()
    moves = rate(move, seconds)
    worlds.close()
    return moves * FLYING.control_timestep


def _collecting(seconds: float) -> tuple[float, float]:
    """Return frames per second with vehicle dynamics, and the ratio to computer-vision mode."""
    rates = []
    for count in _COLLECTED:
        flying, still = (default_collector(count, "cpu", d) for d in (FLYING, DynamicsSettings()))
        work = [partial(_collect, collector) for collector in (flying, still)]
        for collect in work:
            collect()
        rates.append(paired(*work, seconds=seconds, rounds=5))
        for collector in (flying, still):
            collector.shutdown()
    best_flying = max(a for a, _, _ in rates)
    return best_flying, best_flying / max(b for _, b, _ in rates)


def _collect(collector: Any) -> int:
    return len(collector.collect())
