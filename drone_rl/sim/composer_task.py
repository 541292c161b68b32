"""A dm_control task for any `Task`: its rules and dynamics with a batch of one."""

import dataclasses
import functools
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
from drone_rl.sim.dynamics import BodyState, Dynamics, draw_seeds, make_dynamics
from drone_rl.sim.dynamics.state import twist_about_z
from drone_rl.sim.quiet_dm_control import composer, mjcf, observable
from drone_rl.sim.rendering import Appearance, Poses, Raytracer, View
from drone_rl.sim.rendering.scene import Scene, SemanticClass, compiled
from drone_rl.sim.tasks import State, Task, as_task
from drone_rl.sim.tasks.common import HIDDEN_DEPTH
from drone_rl.sim.visual_randomization import AppearanceSampler
from drone_rl.utils.errors import InputError
from drone_rl.utils.plugins import errors_of, place_of

CONTROL_TIMESTEP_S = 0.1
"""Simulated time of one step, seconds. Computer-vision mode has no physics to depend on it."""


def seconds_per_step(dynamics: Dynamics) -> float:
    """Return the simulated seconds of a step; in computer-vision mode nothing depends on them."""
    return getattr(dynamics, "timestep", None) or CONTROL_TIMESTEP_S


class ComposerTask(composer.Task):
    """A field with the drone and a task's props. The discount is 0 at termination, 1 at truncation.

    Dynamics move the drone, as in `Worlds`; MuJoCo's physics does not.
    """

    def __init__(
        self,
        task: BaseTaskSettings | Task[Any] | None = None,
        camera: CameraSettings | None = None,
        *,
        dynamics: Dynamics | DynamicsSettings | None = None,
        actions: ActionSettings | None = None,
        pixels: bool = True,
        distractors: int = 0,
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
            distractors: Number of distractors in the model; only an appearance places them.
            appearance: Visual appearance, sampled for each episode; the task's by default.

        Raises:
            InputError: A texture can't be read, camera or distractors do not fit, or dynamics with
                actions of their own are given other ones.
        """
        self.rules = as_task(task)
        self.dynamics = make_dynamics(self.rules.make_dynamics, dynamics, actions)
        self.rules.check_actions(self.dynamics.actions)
        self.camera = camera or CameraSettings()
        self._sampler = None
        if appearance is not None and not appearance.is_minimal:
            self._sampler = AppearanceSampler(appearance, 1, task=self.rules, camera=self.camera)
            distractors = self._sampler.distractors
        self._distractors = distractors
        self._arena = entities.Field()
        model: Any = self._arena.mjcf_model
        model.option.gravity = (0, 0, 0)
        self.drone = entities.DroneEntity(size=self.rules.drone_size, camera=self.camera)
        self._arena.add_free_entity(self.drone)
        with errors_of(f"task={self.rules.name}", place_of(self.rules.make_props)):
            props = self.rules.make_props()
        self._props = [*props, *entities.make_distractors(distractors)]
        self._frames = [self._arena.attach(prop) for prop in self._props]
        for frame in self._frames:
            frame.mocap = True
        self.appearance: Appearance | None = None
        """Appearance of the running episode; None for the task's own."""
        self._begin(np.random.RandomState(0))
        self._task_observables: dict[str, observable.Observable] = {
            name: observable.Generic(lambda _, name=name: self._read(name))
            for name in self.rules.observed
        }
        if pixels:
            self._task_observables["drone/front_center"] = self._camera_observable()
        for info in self._task_observables.values():
            info.enabled = True
        self.set_timesteps(*(seconds_per_step(self.dynamics),) * 2)

    def __getstate__(self) -> dict[str, Any]:
        """Refuse to copy or pickle, which dm_control's models do not support."""
        raise InputError(
            f"a dm_control environment of task={self.rules.name} can't be copied or pickled; "
            "call make_environment again"
        )

    @property
    def root_entity(self) -> entities.Field:
        """The arena."""
        return self._arena

    @property
    def task_observables(self) -> dict[str, observable.Observable]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The entries `Task.observed` of `Task.info`, and the policy's camera."""
        return self._task_observables

    def action_spec(self, physics: mjcf.Physics) -> specs.Array:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return the spec of the dynamics' action."""
        entry = self.dynamics.actions.entry
        if entry.dtype == torch.int64 and entry.high is not None:
            return specs.DiscreteArray(int(entry.high) + 1, name="action")
        low, high = (-np.inf if v is None else v for v in (entry.low, entry.high))
        return specs.BoundedArray(entry.shape, np.float64, low, high, name="action")

    def compile(self) -> Scene:
        """Return the model that dm_control simulates, with the semantic classes of its geoms."""
        arena: Any = self._arena.mjcf_model  # None in dm_control's annotations
        physics = compiled(arena, f"the scene of task={self.rules.name}")
        model = physics.model.ptr
        classes, props = [SemanticClass.GROUND] * model.ngeom, [-1] * model.ngeom
        for number, entity in [(-1, self.drone), *enumerate(self._props)]:
            for geom in physics.bind(entity.mjcf_model.find_all("geom")).element_id:
                classes[geom], props[geom] = entity.semantic_class, number
        return Scene(model, tuple(classes), tuple(props), entities.SKY_COLOR)

    def initialize_episode(
        self, physics: mjcf.Physics, random_state: np.random.RandomState
    ) -> None:
        """Put the drone at its origin and the props where they are sampled."""
        if self._sampler is not None:
            self._sampler.reset(torch.arange(1), [random_state])
            self.appearance = self._sampler.current() or self._sampler.middle
        self._begin(random_state)
        self._show(physics)

    def before_step(
        self, physics: mjcf.Physics, action: np.ndarray, random_state: np.random.RandomState
    ) -> None:
        """Move the drone."""
        entry = self.dynamics.actions.entry
        actions = torch.as_tensor(action).reshape(1, *entry.shape).to(entry.dtype)
        around = [self.rules.obstacles(self.state)] if self.dynamics.needs_obstacles else []
        self.state.body = self._locate(physics)
        self._body = self.dynamics.step(self.state.body, actions, *around)
        self._show(physics)

    def after_step(self, physics: mjcf.Physics, random_state: np.random.RandomState) -> None:
        """Apply the task's rules."""
        self.state, reward = self.rules.step(self.state, self._locate(physics))
        self._body, self._reward = self.state.body, float(reward)
        self._show(physics)
        physics.forward()  # what is observed next must not show things that have just vanished

    def get_reward(self, physics: mjcf.Physics) -> float:
        """Return the reward of the last step."""
        return self._reward

    def should_terminate_episode(self, physics: mjcf.Physics) -> bool:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return whether the episode has ended."""
        return int(self.state.end_reason) != 0

    def get_discount(self, physics: mjcf.Physics) -> float:
        """Return 0 if the episode terminated, else 1."""
        return 1.0 if int(self.state.end_reason) in (0, self.rules.truncation) else 0.0

    def _begin(self, random_state: np.random.RandomState) -> None:
        origin = torch.tensor([self.rules.origin], dtype=torch.float64)
        sampled = self.rules.sample(random_state)
        seeds = [draw_seeds([random_state])] if self.dynamics.is_random else []
        self.state: State = self.rules.start(sampled[None], self.dynamics.start(origin, *seeds))
        """State of the running episode, as a batch of one."""
        self._body, self._reward = self.state.body, 0.0

    def _locate(self, physics: mjcf.Physics) -> BodyState:
        """Return the drone at MuJoCo's pose, which users may have set."""
        body, expected = self._body, camera_attitude(self.dynamics, self._body)
        place, turn = (torch.from_numpy(np.array(p))[None] for p in self.drone.get_pose(physics))
        cosine = torch.cosine_similarity(turn, expected).abs()  # MuJoCo normalizes quaternions
        is_same = bool(cosine > 1.0 - 1e-12) and torch.equal(place, body.position)
        return body if is_same else body.moved(place, turn)

    def _poses(self) -> Poses:
        state = dataclasses.replace(self.state, body=self._body)
        return poses_of(self.rules, self.dynamics, state, self._distractors, self.appearance)

    def _show(self, physics: mjcf.Physics) -> None:
        poses = self._poses()
        self.drone.set_pose(physics, poses.position[0].numpy(), poses.attitude[0].numpy())
        for frame, place in zip(self._frames, poses.props[0], strict=True):
            physics.bind(frame).mocap_pos = place.numpy()

    def _camera_observable(self) -> observable.Observable:
        """Return the policy's camera, rendered by OpenGL or with an appearance by ray tracing."""
        if self._sampler is not None:
            return observable.Generic(lambda _: self._render())
        return observable.MJCFCamera(
            self.drone.front_center,
            height=self.camera.height,
            width=self.camera.width,
            scene_option=entities.hide_drone(),
        )

    @functools.cached_property
    def _renderer(self) -> Raytracer:
        return Raytracer(self.compile(), num_envs=1, num_shards=1)

    def _render(self) -> np.ndarray:
        height, width = self.camera.height, self.camera.width
        view = View(cameras=("drone/front_center",), height=height, width=width)
        return self._renderer.render(view, self._poses(), self.appearance)["rgb"][0, 0].numpy()

    def _read(self, name: str) -> np.ndarray:
        return self.rules.info(self.state)[name][0].numpy().copy()


def camera_attitude(dynamics: Dynamics, body: BodyState) -> torch.Tensor:
    """Return the attitude of drones' cameras, which is level on a gimbal. Shape: (num_envs, 4)."""
    return twist_about_z(body.attitude) if dynamics.mount == "gimbal" else body.attitude


def poses_of(
    task: Task[Any],
    dynamics: Dynamics,
    state: State,
    distractors: int,
    appearance: Appearance | None = None,
) -> Poses:
    """Return the poses to render: drones, a task's props, and distractors.

    Without an appearance that positions them, the distractors are out of sight.
    """
    props = task.places(state)
    if distractors:
        places = torch.tensor([0.0, 0.0, -HIDDEN_DEPTH]).expand(len(props), distractors, 3)
        if appearance is not None and appearance.distractors is not None:
            places = appearance.distractors.expand(len(props)).places
        props = torch.cat([props, places.to(props)], 1)
    return Poses(state.body.position, camera_attitude(dynamics, state.body), props)


def make_environment(
    task: BaseTaskSettings | Task[Any] | None = None,
    camera: CameraSettings | None = None,
    *,
    random_state: np.random.RandomState | int | None = None,
    dynamics: Dynamics | DynamicsSettings | None = None,
    actions: ActionSettings | None = None,
    pixels: bool = True,
    distractors: int = 0,
    appearance: AppearanceSettings | None = None,
) -> composer.Environment:
    """Return the task as a dm_control environment; see `ComposerTask` for the arguments."""
    made = ComposerTask(
        task,
        camera,
        dynamics=dynamics,
        actions=actions,
        pixels=pixels,
        distractors=distractors,
        appearance=appearance,
    )
    return composer.Environment(
        made,
        random_state=random_state,
        strip_singleton_obs_buffer_dim=True,
        recompile_mjcf_every_episode=False,
    )
