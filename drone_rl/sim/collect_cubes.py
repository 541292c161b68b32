"""The dm_control task: collect the cubes (chapter, section 4)."""

import numpy as np
import torch
from dm_control import composer, mjcf
from dm_control.composer.observation import observable
from dm_env import specs

from drone_rl.sim import rules
from drone_rl.sim.arena import CubeArena
from drone_rl.sim.cube import Cube
from drone_rl.sim.drone import Drone
from drone_rl.sim.settings import CameraSettings, TaskSettings

CONTROL_TIMESTEP_S = 0.1
"""Simulated time of one move, seconds. Computer-vision mode has no physics to depend on it."""
VANISHED_DEPTH = 100.0
"""Metres below its place at which a vanished cube is kept, out of sight under the floor."""


class CollectCubes(composer.Task):
    """Move forward, left or right until every cube is touched, seen through one camera.

    Computer-vision mode (Table 1): an action sets the drone's pose directly; there is no gravity
    and no contact. The reward is 1 a cube; the discount is 0 where the episode terminates (all
    cubes, or out of bounds) and 1 where it is truncated at the step limit.
    """

    def __init__(
        self,
        settings: TaskSettings | None = None,
        camera: CameraSettings | None = None,
        *,
        pixels: bool = True,
    ) -> None:
        """Assembles the world.

        Args:
            settings: Cubes, moves and boundaries; the original study's by default.
            camera: Picture size and field of view; 64x25 pixels and 135 degrees by default.
            pixels: Whether to observe the front-center camera, which needs OpenGL.
        """
        self.settings = settings or TaskSettings()
        self.camera = camera or CameraSettings()
        self._arena = CubeArena()
        self._arena.mjcf_model.option.gravity = (0, 0, 0)
        self._drone = Drone(size=self.settings.drone_size, camera=self.camera)
        self._drone_frame = self._arena.add_free_entity(self._drone)
        self._cubes = [self._add_cube(i) for i in range(self.settings.num_cubes)]
        self._state = rules.start(self.settings, torch.zeros(1, len(self._cubes), 3).double())
        self._reward = 0.0
        self._drone.observables.front_center.enabled = pixels
        self._task_observables = {
            name: observable.Generic(lambda _, read=read: read())
            for name, read in self._info_readers().items()
        }
        for info in self._task_observables.values():
            info.enabled = True
        self.set_timesteps(CONTROL_TIMESTEP_S, CONTROL_TIMESTEP_S)

    def _add_cube(self, index: int) -> mjcf.Element:
        cube = Cube(self.settings.cube_size, self.settings.cube_color, name=f"cube_{index}")
        frame = self._arena.attach(cube)
        frame.mocap = True
        return frame

    @property
    def root_entity(self) -> CubeArena:
        """The arena."""
        return self._arena

    @property
    def drone(self) -> Drone:
        """The drone."""
        return self._drone

    @property
    def state(self) -> rules.WorldState:
        """State of the running episode, as a batch of one world."""
        return self._state

    @property
    def task_observables(self) -> dict[str, observable.Generic]:
        """Algorithm 3's info: cubes collected, which, on which side, and why the episode ended."""
        return self._task_observables

    def action_spec(self, physics: mjcf.Physics) -> specs.DiscreteArray:
        """One of the three moves (`rules.Action`)."""
        del physics
        return specs.DiscreteArray(len(rules.Action), name="action")

    def initialize_episode(
        self, physics: mjcf.Physics, random_state: np.random.RandomState
    ) -> None:
        """Puts the drone at its origin and the cubes at random places (Algorithm 2)."""
        cubes = rules.draw_cubes(self.settings, random_state)
        self._state = rules.start(self.settings, cubes[None])
        self._drone.set_pose(physics, self._state.drone[0].numpy(), (1, 0, 0, 0))
        self._reward = 0.0
        self._show_cubes(physics)

    def before_step(
        self, physics: mjcf.Physics, action: np.ndarray, random_state: np.random.RandomState
    ) -> None:
        """Sets the drone's new pose (computer-vision mode)."""
        del random_state
        move = rules.displacement(self.settings, torch.as_tensor(action).reshape(1).long())
        position, _ = self._drone.get_pose(physics)
        self._drone.set_pose(physics, np.asarray(position) + move[0].numpy(), (1, 0, 0, 0))

    def after_step(self, physics: mjcf.Physics, random_state: np.random.RandomState) -> None:
        """Applies the rules at the place where the drone now is."""
        del random_state
        position = np.array(self._drone.get_pose(physics)[0], dtype=np.float64)
        drone = torch.from_numpy(position)[None]
        self._state, reward = rules.judge(self.settings, self._state, drone)
        self._reward = float(reward)
        self._show_cubes(physics)
        physics.forward()  # what is observed next must not show cubes that have just vanished

    def get_reward(self, physics: mjcf.Physics) -> float:
        """1 for each cube collected by the last move."""
        del physics
        return self._reward

    def should_terminate_episode(self, physics: mjcf.Physics) -> bool:
        """Whether the episode has ended, for whatever reason."""
        del physics
        return self._end_reason is not rules.EndReason.RUNNING

    def get_discount(self, physics: mjcf.Physics) -> float:
        """0 where the episode terminated, 1 where it goes on or was truncated."""
        del physics
        going_on = (rules.EndReason.RUNNING, rules.EndReason.STEP_LIMIT)
        return 1.0 if self._end_reason in going_on else 0.0

    @property
    def _end_reason(self) -> rules.EndReason:
        return rules.EndReason(int(self._state.end_reason))

    def _show_cubes(self, physics: mjcf.Physics) -> None:
        places = shown_cubes(self._state)[0].numpy()
        for frame, place in zip(self._cubes, places, strict=True):
            physics.bind(frame).mocap_pos = place

    def _info_readers(self) -> dict:
        return {
            "cubes": lambda: self._state.collected.sum(-1).numpy(),
            "collected": lambda: self._state.collected[0].numpy(),
            "side": lambda: self._state.side[0].numpy(),
            "end_reason": lambda: self._state.end_reason.numpy(),
        }


def shown_cubes(state: rules.WorldState) -> torch.Tensor:
    """Where to draw the cubes: at their places, or under the floor once vanished.

    Returns:
        Metres, world frame. Shape: (num_worlds, C, 3), float64.
    """
    hidden = (~state.present).double() * VANISHED_DEPTH
    return state.cubes - torch.nn.functional.pad(hidden[..., None], (2, 0))


def make_environment(
    settings: TaskSettings | None = None,
    camera: CameraSettings | None = None,
    *,
    pixels: bool = True,
    random_state: np.random.RandomState | int | None = None,
) -> composer.Environment:
    """The task as a plain dm_control environment, for its viewer and other users of `dm_env`."""
    return composer.Environment(
        CollectCubes(settings, camera, pixels=pixels),
        random_state=random_state,
        strip_singleton_obs_buffer_dim=True,
        recompile_mjcf_every_episode=False,
    )
