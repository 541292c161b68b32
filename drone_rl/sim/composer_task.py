"""A dm_control task for any `Task`: rules with a batch of one, rendered by OpenGL."""

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
from drone_rl.sim.dynamics import BodyState, Dynamics, Quadrotor, draw_seeds, make_dynamics
from drone_rl.sim.dynamics.state import twist_about_z
from drone_rl.sim.mujoco_flight import MujocoFlight
from drone_rl.sim.quiet_dm_control import composer, mjcf, observable
from drone_rl.sim.rendering import Appearance, opengl
from drone_rl.sim.rendering.opengl import OpenGlAppearance
from drone_rl.sim.rendering.scene import Scene, SemanticClass, compiled
from drone_rl.sim.tasks import State, Task, as_task
from drone_rl.sim.tasks.common import HIDDEN_DEPTH
from drone_rl.sim.visual_randomization import AppearanceSampler, object_region_of
from drone_rl.utils.errors import InputError
from drone_rl.utils.plugins import errors_of, place_of

_SKY = 0.69 * entities.DRAW_DISTANCE
"""Metres beyond which only sky is rendered, a ball of 0.7 of MuJoCo's drawing distance."""
CONTROL_TIMESTEP_S = 0.1
"""Simulated time of one step, seconds. Computer-vision mode has no physics to depend on it."""


def seconds_per_step(dynamics: Dynamics) -> float:
    """Return the simulated seconds of a step; in computer-vision mode nothing depends on them."""
    return getattr(dynamics, "timestep", None) or CONTROL_TIMESTEP_S


class ComposerTask(composer.Task):
    """A field with the drone and a task's props. The discount is 0 at termination, 1 at truncation.

    Dynamics move the drone without MuJoCo's physics, except a quadrotor: see `MujocoFlight`.
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
            pixels: Whether to observe the front-center camera, which needs OpenGL.
            distractors: Number of distractors in the model; only an appearance places them.
            appearance: Visual appearance, see `OpenGlAppearance`; the task's by default.

        Raises:
            InputError: A texture can't be read, camera or distractors do not fit, or dynamics with
                actions of their own are given other ones.
        """
        self.rules = as_task(task)
        self.dynamics = make_dynamics(self.rules.make_dynamics, dynamics, actions)
        self.rules.check_actions(self.dynamics.actions)
        self.camera = camera or CameraSettings()
        self._sampler = self._opengl = None
        if appearance is not None and not appearance.is_minimal:
            self._sampler = AppearanceSampler(appearance, 1, task=self.rules, camera=self.camera)
            distractors = self._sampler.distractors
        self._arena = entities.Field()
        model: Any = self._arena.mjcf_model
        model.option.gravity = (0, 0, 0)
        self.drone = entities.Drone(size=self.rules.drone_size, camera=self.camera)
        self._arena.add_free_entity(self.drone)
        with errors_of(f"task={self.rules.name}", place_of(self.rules.make_props)):
            props = self.rules.make_props()
        self._props = [*props, *entities.make_distractors(distractors)]
        self._frames = [self._arena.attach(prop) for prop in self._props]
        for frame in self._frames:
            frame.mocap = True
        self._flight = self._make_flight()
        self._begin(np.random.RandomState(0))
        self._pixels = self.drone.observables.front_center.enabled = pixels  # pyright: ignore[reportAttributeAccessIssue]
        self.appearance: Appearance | None = None
        """Appearance of the running episode; None for the task's own."""
        if self._sampler is not None:
            self._prepare()
        self._task_observables = {
            name: observable.Generic(lambda _, name=name: self._read(name))
            for name in self.rules.observed
        }
        for info in self._task_observables.values():
            info.enabled = True
        steps = (seconds_per_step(self.dynamics),) * 2
        self.set_timesteps(*(steps if self._flight is None else self._flight.timesteps))

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
    def task_observables(self) -> dict[str, observable.Generic]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The entries `Task.observed` of `Task.info`."""
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
        if self._flight is not None:
            self._flight.begin(physics, self.state.body)
        if self.appearance is not None:
            self._apply(physics, self.appearance)
        self._show(physics)

    def before_step(
        self, physics: mjcf.Physics, action: np.ndarray, random_state: np.random.RandomState
    ) -> None:
        """Move the drone."""
        given = torch.as_tensor(action).reshape(1, *self.dynamics.actions.entry.shape)
        given = given.to(self.dynamics.actions.entry.dtype)
        if self._flight is not None:
            self.state.body = self._flight.command(physics, given)
            return
        around = [self.rules.obstacles(self.state)] if self.dynamics.needs_obstacles else []
        self.state.body = self.dynamics.step(self._found(physics), given, *around)
        self._show(physics)

    def before_substep(
        self, physics: mjcf.Physics, action: np.ndarray, random_state: np.random.RandomState
    ) -> None:
        """Apply the forces on a quadrotor."""
        if self._flight is not None:
            self._flight.push(physics)

    def after_substep(self, physics: mjcf.Physics, random_state: np.random.RandomState) -> None:
        """Record the contacts of a quadrotor."""
        if self._flight is not None:
            self._flight.record_contacts(physics)

    def after_step(self, physics: mjcf.Physics, random_state: np.random.RandomState) -> None:
        """Apply the task's rules."""
        flight = self._flight
        body = self._found(physics) if flight is None else flight.finished(physics)
        self.state, reward = self.rules.step(self.state, body)
        self._reward = float(reward)
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
        self._reward = 0.0

    def _found(self, physics: mjcf.Physics) -> BodyState:
        """Return the drone at MuJoCo's pose, which users may have set."""
        body = self.state.body
        place, turn = (torch.from_numpy(np.array(p))[None] for p in self.drone.get_pose(physics))
        is_same_turn = 1.0 - float((turn * self._shown(body)).sum().abs()) < 1e-12  # up to sign
        is_same = is_same_turn and torch.equal(place, body.position)
        return body if is_same else body.moved(place, turn)

    def _shown(self, body: BodyState) -> torch.Tensor:
        """Return the cameras' attitude. Shape: (1, 4)."""
        return twist_about_z(body.attitude) if self.dynamics.mount == "gimbal" else body.attitude

    def _show(self, physics: mjcf.Physics) -> None:
        body = self.state.body
        if self._flight is None:
            self.drone.set_pose(physics, body.position[0].numpy(), self._shown(body)[0].numpy())
        places = self.rules.places(self.state)[0]
        shown = None if self.appearance is None else self.appearance.distractors
        if count := len(self._frames) - len(places):  # without an appearance out of sight
            hidden = places.new_tensor([0.0, 0.0, -HIDDEN_DEPTH]).expand(count, 3)
            places = torch.cat([places, hidden if shown is None else shown.expand(1).places[0]])
        for frame, place in zip(self._frames, places, strict=True):
            physics.bind(frame).mocap_pos = place.numpy()

    def _make_flight(self) -> MujocoFlight | None:
        """Return the integration by MuJoCo of a quadrotor; before the model is compiled."""
        if not isinstance(self.dynamics, Quadrotor):
            return None
        solid = [p.mjcf_model for p in self._props if p.semantic_class == SemanticClass.OBSTACLE]
        return MujocoFlight(self.dynamics, self._arena, self.drone, solid)

    def _prepare(self) -> None:
        root: Any = self._arena.mjcf_model
        opengl.prepare(root)
        camera = self.drone.observables.front_center  # pyright: ignore[reportAttributeAccessIssue]
        camera.render_flag_overrides = opengl.RENDER_FLAGS
        camera.corruptor = self._in_fog

    def _apply(self, physics: mjcf.Physics, appearance: Appearance) -> None:
        if self._opengl is None:
            region = object_region_of(self.rules)
            middle = 0.0 if region is None else (region.first + region.last) / 2
            self._opengl = OpenGlAppearance(self.compile(), middle)
        self._opengl.apply(physics, appearance, self._pixels)
        self._physics = physics

    def _in_fog(self, image: np.ndarray, random_state: np.random.RandomState) -> np.ndarray:
        if self.appearance is None or self.appearance.fog_visibility is None:
            return image
        model, camera = self._physics.model, self.drone.front_center.full_identifier
        number = model.name2id(camera, "camera")
        height, width = image.shape[:2]
        option = entities.hide_drone()
        depth = self._physics.render(height, width, number, depth=True, scene_option=option)
        fovy = float(model.cam_fovy[number])
        return opengl.apply_fog(image, depth, self.appearance, fovy, _SKY)

    def _read(self, name: str) -> np.ndarray:
        return self.rules.info(self.state)[name][0].numpy().copy()


def make_environment(
    task: BaseTaskSettings | Task[Any] | None = None,
    camera: CameraSettings | None = None,
    *,
    random_state: np.random.RandomState | int | None = None,
    **options: Any,
) -> composer.Environment:
    """Return the task as a dm_control environment; `options` are those of `ComposerTask`."""
    return composer.Environment(
        ComposerTask(task, camera, **options),
        random_state=random_state,
        strip_singleton_obs_buffer_dim=True,
        recompile_mjcf_every_episode=False,
    )
