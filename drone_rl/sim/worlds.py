"""Many worlds of the cube collection task at once: the rules in torch, the pictures by Warp."""

from collections.abc import Sequence

import mujoco
import numpy as np
import torch
from dm_control import mjcf
from torch import Tensor

from drone_rl.sim import rules
from drone_rl.sim.arena import SKY_COLOR
from drone_rl.sim.cameras import FRONT_CENTER
from drone_rl.sim.collect_cubes import CollectCubes, shown_cubes
from drone_rl.sim.renderer import Modality, View, WarpRenderer
from drone_rl.sim.settings import CameraSettings, TaskSettings


def compile_model(settings: TaskSettings, camera: CameraSettings) -> mujoco.MjModel:
    """Compiles the very model that the dm_control task simulates."""
    task = CollectCubes(settings, camera, pixels=False)
    return mjcf.Physics.from_mjcf_model(task.root_entity.mjcf_model).model.ptr


class CubeWorlds:
    """`num_worlds` worlds that step, reset and are drawn together, or any of them alone.

    Computer-vision mode (Table 1): an action sets the drone's pose. Flight physics would replace
    the one line of `step` that moves the drone, and `qpos` with it.
    """

    def __init__(
        self,
        num_worlds: int,
        settings: TaskSettings | None = None,
        camera: CameraSettings | None = None,
        *,
        device: str = "cpu",
        num_shards: int | None = None,
    ) -> None:
        """Compiles the model and prepares the policy's camera.

        Args:
            num_worlds: How many.
            settings: The task's.
            camera: The policy's.
            device: "cpu", "cuda" or "cuda:N".
            num_shards: See `WarpRenderer`.
        """
        self.num_worlds = num_worlds
        self.settings = settings or TaskSettings()
        self.camera = camera or CameraSettings()
        self.device = torch.device(device)
        self.model = compile_model(self.settings, self.camera)
        self._num_shards = num_shards
        self._renderers: dict[View, WarpRenderer] = {}
        self.policy_view = self.view()
        places = torch.zeros(num_worlds, self.settings.num_cubes, 3, dtype=torch.float64)
        self.state = rules.start(self.settings, places).to(self.device)

    def view(
        self,
        camera: str = FRONT_CENTER.name,
        modality: Modality = "rgb",
        height: int | None = None,
        width: int | None = None,
        show_drone: bool = False,
    ) -> View:
        """A view of any of the drone's cameras, of the policy's picture size by default."""
        return View(
            camera=f"drone/{camera}",
            height=height or self.camera.height,
            width=width or self.camera.width,
            modality=modality,
            show_drone=show_drone,
        )

    def reset(self, worlds: Tensor, random_states: Sequence[np.random.RandomState]) -> None:
        """Starts new episodes.

        Args:
            worlds: Indices of the worlds. Shape: (k,).
            random_states: One a world, from which its cubes are drawn.
        """
        cubes = [rules.draw_cubes(self.settings, random_state) for random_state in random_states]
        self.state[worlds] = rules.start(self.settings, cubes).to(self.device)

    def step(self, worlds: Tensor, action: Tensor) -> Tensor:
        """Moves the drones of some worlds and applies the rules.

        Args:
            worlds: Indices of the worlds. Shape: (k,).
            action: `rules.Action` of each. Shape: (k,).

        Returns:
            Reward. Shape: (k,), float64.
        """
        everyone = len(worlds) == self.num_worlds
        state = self.state if everyone else self.state[worlds]
        drone = state.drone + rules.displacement(self.settings, action)
        state, reward = rules.judge(self.settings, state, drone)
        if everyone:
            self.state = state
        else:
            self.state[worlds] = state
        return reward

    def render(self, state: rules.WorldState, view: View | None = None) -> Tensor:
        """Draws worlds, be they these or imagined ones.

        Args:
            state: What to draw; any number of worlds.
            view: The policy's camera by default.

        Returns:
            See `WarpRenderer.render`. First dimension: the state's worlds.
        """
        renderer = self._renderer(view or self.policy_view)
        qpos, mocap_pos = self.qpos(state), shown_cubes(state).float()
        parts = [
            renderer.render(q, m)
            for q, m in zip(
                qpos.split(self.num_worlds), mocap_pos.split(self.num_worlds), strict=True
            )
        ]
        return parts[0] if len(parts) == 1 else torch.cat(parts)

    def qpos(self, state: rules.WorldState) -> Tensor:
        """Generalised positions: the drone's place and an upright attitude. Shape: (k, 7)."""
        upright = state.drone.new_tensor([1.0, 0.0, 0.0, 0.0]).expand(len(state.drone), 4)
        return torch.cat([state.drone, upright], dim=-1).float()

    def close(self) -> None:
        """Ends the renderers' threads."""
        for renderer in self._renderers.values():
            renderer.close()

    def prepare(self, view: View | None = None) -> None:
        """Makes a renderer and its kernels ready, which the first picture would do otherwise."""
        self._renderer(view or self.policy_view)

    def _renderer(self, view: View) -> WarpRenderer:
        if view not in self._renderers:
            self._renderers[view] = WarpRenderer(
                self.model,
                view,
                max_worlds=self.num_worlds,
                num_shards=self._num_shards,
                device=str(self.device),
                background=SKY_COLOR,
            )
        return self._renderers[view]
