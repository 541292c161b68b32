"""Simple flight (Table 1): a drone with four rotors, flown by SimpleFlight's controller."""

import functools
from typing import Any

import torch
import warp as wp
from torch import Tensor

from drone_rl.config import ActionSettings, DynamicsSettings
from drone_rl.sim.actions import Actions
from drone_rl.sim.dynamics import flight_kernel, scene_flight_kernel
from drone_rl.sim.dynamics.control import FlightGoals, Moves, Velocities, rotor_goals
from drone_rl.sim.dynamics.rigid_body_kernel import make_airframe
from drone_rl.sim.dynamics.state import CLIMB_INTEGRAL, BodyState, FlightState, Obstacles
from drone_rl.sim.rendering.devices import WorkerPool, on_torch_stream, start_warp

_LEAST_WORK = 3000
"""Ticks of all drones together from which more threads are faster."""


class Quadrotor:
    """Dynamics of drones with four rotors under their controllers."""

    def __init__(self, settings: DynamicsSettings, actions: ActionSettings | None = None) -> None:
        """Take the drone's body, controller and air, and its actions (moves by default)."""
        self.settings = settings
        self._action_settings = actions = actions or ActionSettings()
        if actions.kind == "velocity":
            self.steering = Velocities(actions)
        else:
            self.steering = Moves(actions, settings.rate_limit[2])
        self.frame = make_airframe(settings)
        self.actions: Actions = self.steering.actions
        self.mount: str = settings.camera_mount
        self.is_random = settings.gusts > 0.0
        """Whether there are gusts, which `seeds` make different."""
        self.needs_obstacles = self.stops_at_solids = True
        self.timestep: float | None = settings.control_timestep
        speed = actions.forward_speed if actions.kind == "velocity" else actions.move_speed
        self.stride = speed * settings.control_timestep

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy the settings; Warp's structs can't be copied."""
        return type(self), (self.settings, self._action_settings)

    def start(self, position: Tensor, seeds: Tensor | None = None) -> FlightState:
        """Return drones that hover at rest; see `Dynamics`."""
        state = FlightState.at_rest(position, seeds=seeds)
        state.rotors[:] = self.settings.hover_throttle
        state.numbers[:, CLIMB_INTEGRAL] = 2.0 * self.settings.hover_throttle - 1.0
        return state

    def step(
        self, body: BodyState, action: Tensor, obstacles: Obstacles | None = None
    ) -> FlightState:
        """See `Dynamics.step`."""
        assert isinstance(body, FlightState)
        return self.fly(
            body, self.steering.goals(body, action), self.settings.control_ticks, obstacles
        )

    def push(self, body: FlightState, rotors: Tensor, ticks: int = 1) -> FlightState:
        """Return the drones after ticks under rotor thrusts, see `FlightState.rotors`."""
        return self.fly(body, rotor_goals(rotors), ticks)

    def fly(
        self, body: FlightState, goals: FlightGoals, ticks: int, obstacles: Obstacles | None = None
    ) -> FlightState:
        """Return the drones after ticks under their controllers; `body` stays as it is."""
        device, count = body.numbers.device, len(body)
        after = torch.empty_like(body.numbers)
        kernel, around = kernel_among(obstacles, str(device))
        command = flight_kernel.make_command(self.frame_among(obstacles), goals, ticks, obstacles)
        arrays = [wp.from_torch(numbers.contiguous()) for numbers in (body.numbers, after)]

        def work(member: int, first: int, last: int) -> None:
            inputs = [first, command, *around, *arrays]
            wp.launch(kernel, last - first, inputs=inputs, device=str(device))

        if device.type == "cpu" and count * ticks >= _LEAST_WORK:
            self._workers.map_spans(0, count, work)
        else:
            with on_torch_stream(device):
                work(0, 0, count)
        return FlightState(after)

    def frame_among(self, obstacles: Obstacles | None) -> Any:
        """Return the airframe's numbers; among a scene's solids, the radius is that of these."""
        if obstacles is None or obstacles.scene is None:
            return self.frame
        return _airframe(self.settings, obstacles.scene.radius)

    @functools.cached_property
    def _workers(self) -> WorkerPool:
        return WorkerPool(2**30)


@functools.lru_cache(8)
def _airframe(settings: DynamicsSettings, radius: float) -> Any:
    return make_airframe(settings.replace(radius=radius))


def kernel_among(obstacles: Obstacles | None, device: str) -> tuple[Any, list[Any]]:
    """Return the kernel that flies a command, and its arguments between command and numbers."""
    if obstacles is None or obstacles.scene is None:
        _load("flight_kernel", device)
        return flight_kernel.fly, []
    _load("scene_flight_kernel", device)
    return scene_flight_kernel.fly_in_scene, [obstacles.scene.solids.at(obstacles.scene.places)]


@functools.cache
def _load(module: str, device: str) -> None:
    """Compile the kernels of a module of this package, or load them, once for a device."""
    start_warp(device)
    wp.load_module(f"{__package__}.{module}", device=device)
