"""A dm_control task for any `Task`: one environment of `Worlds`."""

from typing import Any

import numpy as np
import torch
from dm_env import specs

from drone_rl.config import (
    ActionSettings,
    AppearanceSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
)
from drone_rl.sim import entities
from drone_rl.sim.dynamics import BodyState, Dynamics
from drone_rl.sim.quiet_dm_control import composer, mjcf, observable
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.scene_model import SceneModel
from drone_rl.sim.tasks import State, Task
from drone_rl.sim.visual_randomization import AppearanceSampler
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError

CONTROL_TIMESTEP_S = 0.1
"""Simulated time of one step, seconds. Computer-vision mode has no physics to depend on it."""
_ONLY = torch.zeros(1, dtype=torch.int64)


def seconds_per_step(dynamics: Dynamics) -> float:
    """Return the simulated seconds of a step; in computer-vision mode nothing depends on them."""
    return getattr(dynamics, "timestep", None) or CONTROL_TIMESTEP_S


class ComposerTask(composer.Task):
    """A field with the drone and a task's props. The discount is 0 at termination, 1 at truncation.

    The drone moves by its dynamics, as in `worlds`; MuJoCo's physics does not move it.
    """

    def __init__(
        self,
        task: BaseTaskSettings | Task[Any] | None = None,
        camera: CameraSettings | None = None,
        *,
        dynamics: Dynamics | DynamicsSettings | None = None,
        actions: ActionSettings | None = None,
        pixels: bool = True,
        appearance: AppearanceSettings | None = None,
    ) -> None:
        """Assemble the scene; the task is cube collection by default.

        Args:
            task: A task or its settings.
            camera: The policy's camera.
            dynamics: Vehicle dynamics; the task's default if None.
            actions: Action space, if `dynamics` are settings; the moves by default.
            pixels: Whether to observe the front-center camera, "drone/front_center". OpenGL renders
                it, or the ray tracer if there is an appearance.
            appearance: Visual appearance, sampled for each episode; the task's by default.

        Raises:
            InputError: A texture can't be read, camera or distractors do not fit, or dynamics with
                actions of their own are given other ones.
        """
        self._sampler, distractors = None, 0
        if appearance is not None and not appearance.is_minimal:
            self._sampler = AppearanceSampler(appearance, 1, task=task, camera=camera)
            distractors = self._sampler.distractors
        self.worlds = Worlds(
            1,
            task,
            camera,
            dynamics=dynamics,
            actions=actions,
            distractors=distractors,
            num_shards=1,
        )
        self.camera = self.worlds.camera
        self._model = SceneModel(self.worlds.task, self.camera, distractors)
        self.drone = self._model.drone
        self._reward = 0.0
        self.appearance: Appearance | None = None
        """Appearance of the running episode; None for the task's own."""
        self._task_observables: dict[str, observable.Observable] = {
            name: observable.Generic(lambda _, name=name: self._read(name))
            for name in self.worlds.task.observed
        }
        if pixels:
            self._task_observables["drone/front_center"] = self._camera_observable()
        for info in self._task_observables.values():
            info.enabled = True
        self.set_timesteps(*(seconds_per_step(self.worlds.dynamics),) * 2)

    def __getstate__(self) -> dict[str, Any]:
        """Refuse to copy or pickle, which dm_control's models do not support."""
        raise InputError(
            f"a dm_control environment of task={self.worlds.task.name} can't be copied or pickled; "
            "call make_environment again"
        )

    @property
    def state(self) -> State:
        """State of the running episode, as a batch of one."""
        return self.worlds.state

    @property
    def root_entity(self) -> entities.Field:
        """The arena."""
        return self._model.field

    @property
    def task_observables(self) -> dict[str, observable.Observable]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The entries `Task.observed` of `Task.info`, and the policy's camera."""
        return self._task_observables

    def action_spec(self, physics: mjcf.Physics) -> specs.Array:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return the spec of the dynamics' action."""
        entry = self.worlds.dynamics.actions.entry
        if entry.dtype == torch.int64 and entry.high is not None:
            return specs.DiscreteArray(int(entry.high) + 1, name="action")
        low, high = (-np.inf if v is None else v for v in (entry.low, entry.high))
        return specs.BoundedArray(entry.shape, np.float64, low, high, name="action")

    def initialize_episode(
        self, physics: mjcf.Physics, random_state: np.random.RandomState
    ) -> None:
        """Put the drone at its origin and the props where they are sampled."""
        if self._sampler is not None:
            self._sampler.reset(_ONLY, [random_state])
            self.appearance = self._sampler.current() or self._sampler.middle
        self.worlds.reset(_ONLY, [random_state])
        self._reward = 0.0
        self._show(physics)

    def before_step(
        self, physics: mjcf.Physics, action: np.ndarray, random_state: np.random.RandomState
    ) -> None:
        """Move the drone and apply the task's rules."""
        entry = self.worlds.dynamics.actions.entry
        actions = torch.as_tensor(action).reshape(1, *entry.shape).to(entry.dtype)
        self.state.body = self._locate(physics)
        self._reward = float(self.worlds.step(_ONLY, actions))

    def after_step(self, physics: mjcf.Physics, random_state: np.random.RandomState) -> None:
        """Show the new state, whatever MuJoCo's physics did."""
        self._show(physics)
        physics.forward()

    def get_reward(self, physics: mjcf.Physics) -> float:
        """Return the reward of the last step."""
        return self._reward

    def should_terminate_episode(self, physics: mjcf.Physics) -> bool:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return whether the episode has ended."""
        return int(self.state.end_reason) != 0

    def get_discount(self, physics: mjcf.Physics) -> float:
        """Return 0 if the episode terminated, else 1."""
        return 1.0 - float(self.worlds.ends()[0])

    def _locate(self, physics: mjcf.Physics) -> BodyState:
        """Return the drone at MuJoCo's pose, which users may have set."""
        body, attitude = self.state.body, self.worlds.poses(self.state).attitude
        place, turn = (torch.from_numpy(np.array(p))[None] for p in self.drone.get_pose(physics))
        cosine = torch.cosine_similarity(turn, attitude).abs()  # MuJoCo normalizes quaternions
        is_same = bool(cosine > 1.0 - 1e-12) and torch.equal(place, body.position)
        return body if is_same else body.moved(place, turn)

    def _show(self, physics: mjcf.Physics) -> None:
        poses = self.worlds.poses(self.state, self.appearance)
        self.drone.set_pose(physics, poses.position[0].numpy(), poses.attitude[0].numpy())
        for frame, place in zip(self._model.frames, poses.props[0], strict=True):
            physics.bind(frame).mocap_pos = place.numpy()

    def _camera_observable(self) -> observable.Observable:
        """Return the policy's camera, rendered by OpenGL or with an appearance by ray tracing."""
        if self._sampler is not None:
            return observable.Generic(
                lambda _: self.worlds.render(self.state, appearance=self.appearance)[0].numpy()
            )
        return observable.MJCFCamera(
            self.drone.front_center,
            height=self.camera.height,
            width=self.camera.width,
            scene_option=entities.hide_drone(),
        )

    def _read(self, name: str) -> np.ndarray:
        return self.worlds.info()[name][0].numpy()


def make_environment(
    task: BaseTaskSettings | Task[Any] | None = None,
    camera: CameraSettings | None = None,
    *,
    random_state: np.random.RandomState | int | None = None,
    dynamics: Dynamics | DynamicsSettings | None = None,
    actions: ActionSettings | None = None,
    pixels: bool = True,
    appearance: AppearanceSettings | None = None,
) -> composer.Environment:
    """Return the task as a dm_control environment; see `ComposerTask` for the arguments."""
    made = ComposerTask(
        task,
        camera,
        dynamics=dynamics,
        actions=actions,
        pixels=pixels,
        appearance=appearance,
    )
    return composer.Environment(
        made,
        random_state=random_state,
        strip_singleton_obs_buffer_dim=True,
        recompile_mjcf_every_episode=False,
    )
