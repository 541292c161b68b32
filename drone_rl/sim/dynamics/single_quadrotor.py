"""One drone that flies many short commands: the memory and the launch of its kernel are kept."""

import dataclasses
from typing import Any

import torch
import warp as wp

from drone_rl.config import ActionSettings, DynamicsSettings
from drone_rl.sim.dynamics import flight_kernel
from drone_rl.sim.dynamics.control import FlightGoals
from drone_rl.sim.dynamics.quadrotor import Quadrotor, kernel_among
from drone_rl.sim.dynamics.state import NUMBERS, FlightState, Obstacles


class SingleQuadrotor(Quadrotor):
    """A `Quadrotor` for one drone on the CPU, with the same states, bit for bit.

    A launch is prepared once: to prepare it takes several times as long as the few ticks of a
    control period. Only one thread may use it at a time.
    """

    def __init__(self, settings: DynamicsSettings, actions: ActionSettings | None = None) -> None:
        """See `Quadrotor`."""
        super().__init__(settings, actions)
        double = torch.float64
        self._before = torch.zeros(1, NUMBERS, dtype=double)
        self._after = torch.zeros(1, NUMBERS, dtype=double)
        self._values, self._drifts = torch.zeros(2, 1, 4, dtype=double)
        self._centers = self._places = torch.zeros(1, 0, 3, dtype=double)
        self._prepared: Any = None
        """What the launch depends on apart from these tensors."""
        self._launch: Any = None

    def fly(
        self, body: FlightState, goals: FlightGoals, ticks: int, obstacles: Obstacles | None = None
    ) -> FlightState:
        """See `Quadrotor`."""
        if len(body) != 1 or body.numbers.device.type != "cpu":
            return super().fly(body, goals, ticks, obstacles)
        around = None
        if obstacles is not None:
            scene = obstacles.scene and (obstacles.scene.solids, obstacles.scene.radius)
            around = (obstacles.centers.shape, obstacles.half_sizes, scene)
        wanted = (goals.modes, ticks, around)
        if wanted != self._prepared:
            self._prepare(goals, ticks, obstacles)
            self._prepared = wanted
        self._before.copy_(body.numbers)
        self._values.copy_(goals.values)
        self._drifts.copy_(goals.drifts)
        if obstacles is not None:
            self._centers.copy_(obstacles.centers)
            if obstacles.scene is not None:
                self._places.copy_(obstacles.scene.places)
        self._launch.launch()
        return FlightState(self._after.clone())

    def _prepare(self, goals: FlightGoals, ticks: int, obstacles: Obstacles | None) -> None:
        around = None
        if obstacles is not None:
            self._centers = torch.empty_like(obstacles.centers)
            scene = obstacles.scene
            if scene is not None:
                self._places = torch.empty_like(scene.places)
                scene = dataclasses.replace(scene, places=self._places)
            around = dataclasses.replace(obstacles, centers=self._centers, scene=scene)
        kernel, solids = kernel_among(around, "cpu")  # starts Warp
        held = FlightGoals(goals.modes, self._values, self._drifts)
        command = flight_kernel.make_command(self.frame_among(around), held, ticks, around)
        arrays = [wp.from_torch(numbers) for numbers in (self._before, self._after)]
        inputs = [0, command, *solids, *arrays]
        self._launch = wp.launch(kernel, 1, inputs=inputs, device="cpu", record_cmd=True)
