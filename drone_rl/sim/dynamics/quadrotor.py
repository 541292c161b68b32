# pyright: reportArgumentType=false
# (Warp's annotations say less than it takes.)
"""Simple flight (Table 1): a drone with four rotors, flown by SimpleFlight's controller."""

import functools
from typing import Any

import torch
import warp as wp
from torch import Tensor

from drone_rl.config import ActionSettings, DynamicsSettings
from drone_rl.sim.actions import Actions
from drone_rl.sim.dynamics import flight_kernel
from drone_rl.sim.dynamics.control import Goals, make_steering, rotor_goals
from drone_rl.sim.dynamics.rigid_body_kernel import make_airframe
from drone_rl.sim.dynamics.state import CLIMB, BodyState, FlightState, Obstacles
from drone_rl.sim.rendering.devices import WorkerPool, on_torch_stream, start_warp

_LEAST_WORK = 3000
"""Ticks of all drones together for which a second thread is worth its while."""


class Quadrotor:
    """Flies drones. It holds none: states come in, states go out, as many as they are."""

    def __init__(self, settings: DynamicsSettings, actions: ActionSettings | None = None) -> None:
        """Takes a drone.

        Args:
            settings: Its body, controller and air.
            actions: What policies can tell it; the chapter's three moves by default.
        """
        self.settings = settings
        self.steering = make_steering(actions or ActionSettings())
        self.frame = make_airframe(settings)

    @property
    def actions(self) -> Actions:
        """What policies can tell it."""
        return self.steering.actions

    @property
    def mount(self) -> str:
        """How its cameras are mounted, see `DynamicsSettings.camera_mount`."""
        return self.settings.camera_mount

    @property
    def is_random(self) -> bool:
        """Whether episodes differ by the seed that `start` is given."""
        return self.settings.gusts > 0.0

    @property
    def needs_obstacles(self) -> bool:
        """Whether `step` minds what stands around."""
        return True

    def start(self, position: Tensor, seeds: Tensor | None = None) -> FlightState:
        """Drones that hover where they are, at rest.

        Args:
            position: Metres, world frame. Shape: (num_worlds, 3), float64.
            seeds: Of their gusts; all the same by default. Shape: (num_worlds,).
        """
        state = FlightState.at_rest(position, seeds=seeds)
        state.rotors[:] = self.settings.hover_throttle
        state.numbers[:, CLIMB.first] = 2.0 * self.settings.hover_throttle - 1.0
        return state

    def step(
        self, body: BodyState, action: Tensor, obstacles: Obstacles | None = None
    ) -> FlightState:
        """What an action makes of each drone, a control step later; see `Dynamics`."""
        assert isinstance(body, FlightState)
        return self.fly(
            body, self.steering.goals(body, action), self.settings.control_ticks, obstacles
        )

    def push(self, body: FlightState, rotors: Tensor, ticks: int = 1) -> FlightState:
        """The drones under rotors that somebody else commands.

        Args:
            body: Before.
            rotors: Shares of their most thrust. Shape: (num_worlds, 4), see `FlightState.rotors`.
            ticks: How long.
        """
        return self.fly(body, rotor_goals(rotors), ticks)

    def fly(
        self, body: FlightState, goals: Goals, ticks: int, obstacles: Obstacles | None = None
    ) -> FlightState:
        """The drones under their controllers; `body` stays as it is.

        Args:
            body: Before.
            goals: What they are told, for all of the time.
            ticks: How long, each of `DynamicsSettings.tick` seconds.
            obstacles: What they may touch besides the ground.
        """
        device, count = body.numbers.device, len(body)
        _load_kernels(str(device))
        after = torch.empty_like(body.numbers)
        centers, half_sizes = _boxes(obstacles, body)
        given = [
            _array(goals.values),
            _array(goals.drifts),
            _array(centers, wp.vec3d),
            wp.vec3(*half_sizes),
            _array(body.numbers),
            _array(after),
        ]
        modes = wp.vec4i(*(int(mode) for mode in goals.modes))

        def work(member: int, first: int, last: int) -> None:
            del member
            inputs = [first, self.frame, ticks, modes, *given]
            wp.launch(flight_kernel.fly, last - first, inputs=inputs, device=str(device))

        if device.type == "cpu" and count * ticks >= _LEAST_WORK:
            self._workers.map_spans(0, count, work)
        else:
            with on_torch_stream(device):
                work(0, 0, count)
        return FlightState(after)

    @functools.cached_property
    def _workers(self) -> WorkerPool:
        return WorkerPool(2**30)


@functools.cache
def _load_kernels(device: str) -> None:
    start_warp(device)
    wp.load_module(flight_kernel, device=device)


def _array(value: Tensor, kind: Any = wp.float64) -> Any:
    return wp.from_torch(value.contiguous(), dtype=kind, return_ctype=True)


def _boxes(obstacles: Obstacles | None, body: FlightState) -> tuple[Tensor, tuple[float, ...]]:
    if obstacles is None:
        return body.numbers.new_zeros(len(body), 0, 3), (0.0, 0.0, 0.0)
    return obstacles.centers, obstacles.half_sizes
