"""Inputs of policies that are vectors: what they measure, and their errors."""

from typing import Any

import torch
from torch import Tensor

from drone_rl.config.inputs import VectorInput
from drone_rl.envs.fault_models import FaultModel, Sample, frozen_frames, late_frames
from drone_rl.sim.coordinates import body_from_world
from drone_rl.sim.sensors.instruments import specific_force
from drone_rl.sim.tasks import State
from drone_rl.sim.tasks.objects import ObjectState
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError


def measure(quantity: str, worlds: Worlds, state: State) -> Tensor:
    """Return a quantity of `drone_rl.config.inputs.SIZES` without errors, float32. Shape: (k, n).

    "imu" are velocity, world frame, attitude and angular velocity, from which `error_models` makes
    the measured values.

    Raises:
        InputError: The drones or the task have no such quantity.
    """
    body = state.body
    if quantity in ("goal", "last_action"):
        if not isinstance(state, ObjectState):
            raise InputError(
                f"task={worlds.task.name} has no {quantity}; leave this input out, or make the "
                "task of terms (drone_rl.define_task)"
            )
        return state.action.clone() if quantity == "last_action" else _goal(state).float()
    if quantity in ("velocity", "rates", "imu") and worlds.dynamics.timestep is None:
        raise InputError(
            f"drones that move at once have no {quantity}; give dynamics=quadrotor, or leave this "
            "input out"
        )
    if quantity == "attitude":
        return torch.where(body.attitude[:, :1] < 0, -body.attitude, body.attitude).float()
    measured = {
        "velocity": lambda: body_from_world(body.attitude, body.velocity),
        "rates": lambda: body.angular_velocity,
        "altitude": lambda: body.position[:, 2:],
        "imu": lambda: torch.cat([body.velocity, body.attitude, body.angular_velocity], 1),
    }
    return measured[quantity]().float()


def _goal(state: ObjectState) -> Tensor:
    """Return vectors to the goals that are ahead, 0 where none is, drone's axes. Shape: (k, 3)."""
    ahead = state.ahead.long()
    place = state.places[torch.arange(len(ahead), device=ahead.device), ahead.clamp(min=0)]
    away = body_from_world(state.body.attitude, place - state.body.position)
    return torch.where(ahead[:, None] < 0, 0.0, away)


def error_models(seen: VectorInput, worlds: Worlds) -> dict[str, FaultModel]:
    """Return the steps from what `measure` returns to the input, times its scale, by name."""
    steps: dict[str, FaultModel] = {}
    if seen.quantity == "imu":
        steps["imu"] = _imu(worlds.dynamics.timestep or 1.0)
    if seen.noise:
        steps["noise"] = _noise(seen.noise)
    if seen.bias:
        steps["bias"] = _bias(seen.bias)
    if seen.delay:
        steps["delay"] = late_frames(seen.delay)
    if seen.loss:
        steps["loss"] = frozen_frames(seen.loss)
    return steps


def _noise(deviation: float) -> FaultModel:
    """Add white noise."""

    def begin(values: Tensor, sample: Sample) -> Tensor:
        return sample(*values.shape[1:], normal=True)

    return FaultModel(
        lambda values, memory, _: values + deviation * memory,
        begin,
        lambda memory, values, sample: begin(values, sample),
    )


def _bias(most: float) -> FaultModel:
    """Add a constant of each episode, uniform within `most`."""

    def begin(values: Tensor, sample: Sample) -> Tensor:
        return most * (2 * sample(*values.shape[1:]) - 1)

    return FaultModel(lambda values, memory, _: values + memory, begin)


def _imu(seconds: float) -> FaultModel:
    """Make specific force and angular velocity of what `measure` returns in two steps."""

    def show(values: Tensor, memory: Tensor, blank: float) -> Tensor:
        del blank
        attitude, rates = values[:, 3:7, 0, 0], values[:, 7:]
        before, after = memory.double().unbind(1)
        force: Any = specific_force(attitude.double(), before, after, seconds)
        return torch.cat([force.float()[..., None, None], rates], 1)

    return FaultModel(
        show,
        lambda values, _: values[:, None, :3, 0, 0].repeat(1, 2, 1),
        lambda memory, values, _: torch.stack([memory[:, 1], values[:, :3, 0, 0]], 1),
    )
