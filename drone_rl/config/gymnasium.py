"""What can be chosen about a Gymnasium environment besides its task."""

import dataclasses
from typing import Annotated

from drone_rl.config import ActionSettings, CameraSettings, DynamicsSettings, RendererName
from drone_rl.utils.schema import OneOf
from drone_rl.utils.settings import Settings


@dataclasses.dataclass(frozen=True, kw_only=True)
class GymnasiumSettings(Settings):
    """Options of `gymnasium.make`; no command has them, so that no file of conf/ does."""

    observations: Annotated[str, OneOf(("pixels", "state"))] = "pixels"
    """The camera's frame, or the true state in a vector."""
    camera: CameraSettings = CameraSettings()
    """The picture that the drone takes."""
    dynamics: DynamicsSettings = DynamicsSettings()
    """How it moves."""
    actions: ActionSettings = ActionSettings()
    """What it can be asked for."""
    render_mode: Annotated[str, OneOf(("rgb_array",))] | None = None
    """What `render` returns: none for nothing, rgb_array for the drone from behind."""
    device: str = "cpu"
    """Where worlds are drawn: cpu, cuda or cuda:N."""
    renderer: RendererName = "raytrace"
    """Who draws: raytrace, our own, or mujoco_warp, MuJoCo Warp's."""
