"""The drone from behind: its body as it is tilted, the camera that films it level."""

import dataclasses

import torch
from torch import Tensor

from drone_rl.sim.dynamics import FlightState
from drone_rl.sim.dynamics.body import heading_only
from drone_rl.sim.entities import CHASE
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.appearance import Mounting, product, rotate
from drone_rl.sim.worlds import Worlds

_BACK = (1.0, -1.0, -1.0, -1.0)
"""Signs that turn a quaternion into its inverse."""


def film(worlds: Worlds, look: Appearance | None, height: int, width: int) -> Tensor:
    """The worlds' drones from behind.

    In flight the chase camera follows the heading alone, whatever holds the drone's own cameras, so
    that one sees how the body is tilted. Else the drone is level with its cameras, as it is drawn.

    Args:
        worlds: Of which all are drawn.
        look: How they look otherwise than all of them do.
        height: Pixels.
        width: Pixels.

    Returns:
        Colours. Shape: (num_worlds, height, width, 3), uint8.
    """
    view = worlds.view(CHASE.name, height=height, width=width, show_drone=True)
    state = worlds.state
    if not isinstance(state.body, FlightState):
        return worlds.render(state, view, look)
    attitude = state.body.attitude
    whole = (look or Appearance()).over(worlds.appearance)
    tilted = dataclasses.replace(worlds.poses(state, whole), attitude=attitude)
    held = dataclasses.replace(whole, camera=level(attitude, view.cameras[0]))
    return worlds.renderer.render(view, tilted, held)["rgb"][:, 0]


def level(attitude: Tensor, camera: str) -> Mounting:
    """The chase camera on bodies that are tilted, held as if they were not.

    Args:
        attitude: Of the bodies, quaternions (w, x, y, z). Shape: (num_worlds, 4).
        camera: Its full name in the model.
    """
    back = product(attitude * attitude.new_tensor(_BACK), heading_only(attitude))
    place = torch.tensor(CHASE.pos, dtype=attitude.dtype, device=attitude.device)
    return Mounting(camera=camera, offset=rotate(back, place) - place, turn=back)
