"""A batch of environments of a task: rules, dynamics and a renderer."""

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self, TypeVar, cast

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import ActionSettings, BaseTaskSettings, CameraSettings, DynamicsSettings
from drone_rl.sim.actions import Entry
from drone_rl.sim.dynamics import BodyState, Dynamics, draw_seeds, make_dynamics
from drone_rl.sim.dynamics.state import twist_about_z
from drone_rl.sim.entities import FRONT_CENTER
from drone_rl.sim.rendering import (
    Appearance,
    Poses,
    Renderer,
    RendererFactory,
    Scene,
    View,
    find_renderer,
)
from drone_rl.sim.rendering.devices import check_device
from drone_rl.sim.rendering.view import Modality
from drone_rl.sim.scene_model import SceneModel
from drone_rl.sim.tasks import State, Task, as_task
from drone_rl.sim.tasks.common import HIDDEN_DEPTH
from drone_rl.sim.tasks.objects import follows_rules
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Instance

LARGEST_REWARD = 1e10
"""Largest reward of a step, so that sums of rewards and of their squares are finite in float32."""
Method = TypeVar("Method", bound=Callable[..., Any])
_POSE = {"drone": Entry((3,), torch.float32), "attitude": Entry((4,), torch.float32)}


def _outside_inference_mode(method: Method) -> Method:
    """Leave PyTorch's inference mode, whose tensors can't be changed after it."""

    @functools.wraps(method)
    def call(*args: Any, **kwargs: Any) -> Any:
        if not torch.is_inference_mode_enabled():
            return method(*args, **kwargs)
        with torch.inference_mode(False), torch.no_grad():  # leaving it alone records gradients
            return method(*args, **kwargs)

    return cast(Method, call)


class Worlds:
    """`num_envs` environments that step, reset and render together, or any of them alone."""

    @_outside_inference_mode
    def __init__(
        self,
        num_envs: int,
        task: BaseTaskSettings | Task[Any] | None = None,
        camera: CameraSettings | None = None,
        *,
        dynamics: Dynamics | DynamicsSettings | None = None,
        actions: ActionSettings | None = None,
        renderer: str | RendererFactory = "raytrace",
        device: str = "cpu",
        num_shards: int | None = None,
        appearance: Appearance | None = None,
        distractors: int = 0,
    ) -> None:
        """Create the environments.

        Args:
            num_envs: Batch size.
            task: See `drone_rl.envs.DroneEnv`, as for the arguments up to `num_shards`.
            camera: See there.
            dynamics: See there.
            actions: See there.
            renderer: See there.
            device: See there.
            num_shards: See there.
            appearance: One appearance for all episodes; the task's own by default.
            distractors: Number of distractors in the model; an appearance places them.

        Raises:
            InputError: An argument is unusable.
        """
        check_device(device)
        self.appearance = Instance(Appearance | None).read(appearance, "appearance")
        self.distractors = distractors
        self._combined: tuple[Appearance, Appearance | None, Appearance] | None = None
        """The last appearance given, the default one, and both combined."""
        self.num_envs = num_envs
        self.task = as_task(task)
        self.camera = camera or CameraSettings()
        self.dynamics = make_dynamics(self.task.make_dynamics, dynamics, actions)
        self.task.check_dynamics(self.dynamics)
        self._needs_obstacles = self.dynamics.needs_obstacles or (
            bool(getattr(self.task, "scenes", ()))
            and getattr(self.dynamics, "stops_at_solids", False)
        )
        self.device = torch.device(device)
        self._every = torch.arange(num_envs, device=self.device)
        self._make_renderer, self._num_shards = find_renderer(renderer), num_shards
        self.policy_view = self.view()
        sampled = self.task.sample(np.random.RandomState(0))
        self.state = self.start(torch.zeros_like(sampled).expand(num_envs, *sampled.shape).clone())

    def __getstate__(self) -> dict[str, Any]:
        """Return the state of a deep copy, which builds its own scene and renderer when needed."""
        return {k: v for k, v in vars(self).items() if k not in ("scene", "renderer")}

    def __copy__(self) -> Self:
        """Return a shallow copy, which shares scene and renderer."""
        made = object.__new__(type(self))
        vars(made).update(vars(self))
        return made

    @property
    def entries(self) -> Mapping[str, Entry]:
        """`Task.entries`, "drone" (metres) and "attitude" (quaternion w, x, y, z), world frame."""
        return {**self.task.entries, **_POSE}

    def info(self, state: State | None = None) -> dict[str, Tensor]:
        """Return copies of the true state, by default of these worlds; see `entries`. (N, *)."""
        state = self.state if state is None else state
        pose = {"drone": state.body.position.float(), "attitude": state.body.attitude.float()}
        info = {**self.task.info(state), **pose}
        return {name: value.clone() for name, value in info.items()}

    def ends(self, end_reason: Tensor | None = None) -> tuple[Tensor, Tensor]:
        """Return which episodes terminated and which were truncated. Shapes: (N,)."""
        reason = self.state.end_reason if end_reason is None else end_reason
        truncated = reason == self.task.truncation
        return (reason != 0) & ~truncated, truncated

    @functools.cached_property
    def scene(self) -> Scene:
        """The compiled model."""
        return SceneModel(self.task, self.camera, self.distractors).compile()

    @functools.cached_property
    def renderer(self) -> Renderer:
        """The renderer, created at first use."""
        shards, device = self._num_shards, str(self.device)
        return self._make_renderer(
            self.scene, num_envs=self.num_envs, num_shards=shards, device=device
        )

    def view(
        self,
        camera: str | Sequence[str] = FRONT_CENTER.name,
        modality: Modality | Sequence[Modality] = "rgb",
        height: int | None = None,
        width: int | None = None,
        show_drone: bool = False,
    ) -> View:
        """Return a view of the drone's cameras, of the policy's image size by default."""
        cameras = (camera,) if isinstance(camera, str) else camera
        return View(
            cameras=tuple(f"drone/{name}" for name in cameras),
            height=self.camera.height if height is None else height,
            width=self.camera.width if width is None else width,
            modalities=(modality,) if isinstance(modality, str) else tuple(modality),
            show_drone=show_drone,
        )

    def start(self, sampled: Tensor, seeds: Tensor | None = None) -> State:
        """Return states at the start of episodes; see `Task.start` and `Dynamics.start`."""
        return self.task.start(sampled, self.bodies(len(sampled), seeds)).to(self.device)

    def bodies(self, count: int, seeds: Tensor | None = None) -> BodyState:
        """Return drones at the start of episodes, on the CPU; see `start`."""
        place = torch.tensor(self.task.origin, dtype=torch.float64).repeat(count, 1)
        return self.dynamics.start(place) if seeds is None else self.dynamics.start(place, seeds)

    @_outside_inference_mode
    def reset(self, env_ids: Tensor, random_states: Sequence[np.random.RandomState]) -> None:
        """Start new episodes in environments, shape (k,), each from a random state."""
        if not len(env_ids):
            return
        sampled = torch.stack([self.task.sample(r) for r in random_states])
        seeds = draw_seeds(random_states) if self.dynamics.is_random else None
        self.state[env_ids] = self.start(sampled, seeds)

    @_outside_inference_mode
    def step(self, env_ids: Tensor, action: Tensor) -> Tensor:
        """Take actions, (k, *), in environments, (k,). Returns rewards, (k,), float64."""
        is_whole = torch.equal(env_ids, self._every)
        state, reward = self.advance(self.state if is_whole else self.state[env_ids], action)
        if is_whole:
            self.state = state
        else:
            self.state[env_ids] = state
        return reward

    def advance(self, state: State, action: Tensor) -> tuple[State, Tensor]:
        """Return states a step later, and rewards; the environments stay as they are.

        Raises:
            InputError: There is not one action for each state, or a reward is unusable.
        """
        if action.shape[:1] != (len(state),):
            raise InputError(
                f"actions of shape {tuple(action.shape)} for {len(state)} environments; give one "
                "action for each, along the first dimension"
            )
        around = [self.task.obstacles(state)] if self._needs_obstacles else []
        body = self.dynamics.step(state.body, action, *around)
        more: Any = (action, self.dynamics) if follows_rules(self.task) else ()
        step: Any = self.task.step
        outcome = step(state, body, *more)
        reward: Any = outcome[1] if isinstance(outcome, tuple) and len(outcome) == 2 else None
        if getattr(reward, "shape", None) != action.shape[:1]:
            raise InputError(
                f"{type(self.task).__name__}.step must return two things: the states after the "
                "step, and the rewards, a tensor with one number for each environment"
            )
        is_usable = reward.abs() <= LARGEST_REWARD  # nor NaN
        if not bool(is_usable.all()):
            raise InputError(
                f"{type(self.task).__name__}.step returns a reward of {reward[~is_usable][0]:g}; "
                f"scale rewards to at most {LARGEST_REWARD:g}, so that their sums stay finite"
            )
        return outcome

    def render(
        self, state: State, view: View | None = None, appearance: Appearance | None = None
    ) -> Tensor:
        """Render states, of any number of environments, with one camera and one modality.

        By default the view is the policy's; `appearance` overrides the environments' own. Returns
        images as `Renderer.render`, without the dimension of cameras.
        """
        view = view or self.policy_view
        if len(view.cameras) * len(view.modalities) > 1:
            raise InputError(
                f"a view of cameras {', '.join(view.cameras)}, each as "
                f"{', '.join(view.modalities)}, is more than one image; call render_all"
            )
        return self.render_all(state, view, appearance)[view.modalities[0]][:, 0]

    @_outside_inference_mode
    def render_all(
        self, state: State, view: View, appearance: Appearance | None = None
    ) -> dict[Modality, Tensor]:
        """Render several cameras and modalities in one pass; see `Renderer.render`."""
        combined = self.combine(appearance)
        return self.renderer.render(view, self.poses(state, combined), combined)

    def combine(self, appearance: Appearance | None) -> Appearance | None:
        """Return the combined appearance; the same object as before if nothing has changed."""
        if appearance is None:
            return self.appearance
        combined = self._combined
        if combined is None or combined[0] is not appearance or combined[1] is not self.appearance:
            whole = appearance.over(self.appearance)
            self._combined = combined = (appearance, self.appearance, whole)
        return combined[2]

    def poses(self, state: State, appearance: Appearance | None = None) -> Poses:
        """Return the poses to render, level on a gimbal; `appearance` positions distractors."""
        props, attitude = self.task.places(state), state.body.attitude
        if self.distractors:
            places = torch.tensor([0.0, 0.0, -HIDDEN_DEPTH]).expand(len(props), self.distractors, 3)
            if appearance is not None and appearance.distractors is not None:
                places = appearance.distractors.expand(len(props)).places
            props = torch.cat([props, places.to(props)], 1)
        if self.dynamics.mount == "gimbal":
            attitude = twist_about_z(attitude)
        return Poses(state.body.position, attitude, props)

    def prepare(self, view: View | None = None) -> None:
        """Prepare the renderer for a view before the first image."""
        self.renderer.prepare(view or self.policy_view)

    def close(self) -> None:
        """Close the renderer, if there is one."""
        if "renderer" in vars(self):
            self.renderer.close()
