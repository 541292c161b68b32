"""Demonstrations: recorded flights that a policy is cloned from, each in a compressed .npz file.

A file contains arrays, see `Demonstration`, and a description in JSON. It may come from an
untrusted source: sizes are checked before memory is allocated, and nothing in it is executed.
"""

import dataclasses
import functools
import io
import re
from contextlib import closing
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
import torch
from numpy.typing import NDArray

from drone_rl.collectors.complete_episodes import rollout
from drone_rl.config import (
    ActionSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
)
from drone_rl.config.configuration import from_arguments
from drone_rl.config.training import TrainSettings
from drone_rl.envs import DroneEnv
from drone_rl.envs.rollout import Recording
from drone_rl.policies.baselines import make_baseline
from drone_rl.sim.actions import Entry
from drone_rl.sim.dynamics import make_dynamics
from drone_rl.sim.tasks import as_task
from drone_rl.utils.archives import read_arrays
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import (
    as_path,
    folder_lock,
    make_folder,
    parse_json,
    refuse_links,
    write_atomically,
)
from drone_rl.utils.models import Model
from drone_rl.utils.schema import Instance, Text, Whole, shown

MOST_DEMONSTRATIONS = 10_000
"""Largest number of demonstrations in a folder."""
_ARRAYS = ("images", "actions", "rewards", "done")
_PILOT = Text(100)
_NAME = re.compile(r"flight_([0-9]{5,9})\.npz")
_PATIENCE_S = 10.0
"""Seconds to wait for another process that adds a flight to the same folder."""


class FlightConditions(Model):
    """Settings under which a flight was recorded, and under which a policy can learn from it."""

    task: BaseTaskSettings
    camera: CameraSettings
    """Camera of the policy."""
    dynamics: DynamicsSettings
    actions: ActionSettings

    @classmethod
    def of(cls, settings: TrainSettings) -> Self:
        """Return the conditions of a training."""
        Instance(TrainSettings).read(settings, "settings")
        return cls(**{name: getattr(settings, name) for name in cls.model_fields})

    def check_same(self, other: "FlightConditions", where: str) -> None:
        """Raise an `InputError` if `other`, those of a training, differ in a value with an effect.

        `where` is the name of the demonstration for messages.
        """
        ours, theirs = self._effective, other._effective
        for name in dict.fromkeys(("dynamics.mode", "actions.kind", *ours, *theirs)):
            recorded, needed = ours.get(name), theirs.get(name)
            if recorded != needed:
                raise InputError(
                    f"{where} was recorded with {name}={_text(recorded)}, but this training has "
                    f"{name}={_text(needed)}; give the training the same value or record again"
                )

    @property
    def _effective(self) -> dict[str, Any]:
        """Values that have an effect, by their names on the command line."""
        names = self.dynamics.effective(self.actions.kind)
        parts = self.model_dump()
        parts["dynamics"] = {name: parts["dynamics"][name] for name in names}
        if names == ("mode",):
            names = ("kind", "turn_step") if self.actions.has_turns else ("kind",)
            parts["actions"] = {name: parts["actions"][name] for name in names}
        return {f"{part}.{k}": v for part, values in parts.items() for k, v in values.items()}

    @functools.cached_property
    def action_entry(self) -> Entry:
        """Shape, type and bounds of one action."""
        default = as_task(self.task).make_dynamics
        return make_dynamics(default, self.dynamics, self.actions).actions.entry


class _About(FlightConditions):
    """The description in a file."""

    format: Literal["drone_rl demonstration"] = "drone_rl demonstration"
    format_version: Literal[1] = 1
    pilot: Annotated[str, _PILOT]


@dataclasses.dataclass(frozen=True, eq=False)
class Demonstration:
    """A recorded flight of T steps, which ends with an episode or before.

    Raises:
        InputError: An array has the wrong shape or type, or a value is out of bounds.
    """

    conditions: FlightConditions
    images: NDArray[np.uint8]  # (T, H, W, 3)
    """Images of the policy's camera before each action, RGB."""
    actions: NDArray[Any]  # (T,), then the shape of an action
    """Actions: int64 if they are discrete, else float32 from -1 to 1."""
    rewards: NDArray[np.float32]  # (T,)
    """Reward of each action."""
    done: NDArray[np.bool_]  # (T,)
    """Whether the episode ended after the action; only the last may be true."""
    pilot: str = "person"
    """Name of what flew, such as "person" or "oracle"."""

    def __post_init__(self) -> None:
        """Check the arrays."""
        _PILOT.read(self.pilot, "pilot")
        if not isinstance(self.conditions, FlightConditions):
            raise InputError(
                f"conditions={shown(self.conditions)} is no FlightConditions; give "
                "FlightConditions.of(settings)"
            )
        steps = len(self.actions) if self.actions.ndim else 0
        if not steps:
            raise InputError("a flight has no steps; record at least one")
        entry, camera = self.conditions.action_entry, self.conditions.camera
        expected = {
            "images": ((steps, camera.height, camera.width, 3), np.dtype(np.uint8)),
            "actions": ((steps, *entry.shape), torch.empty(0, dtype=entry.dtype).numpy().dtype),
            "rewards": ((steps,), np.dtype(np.float32)),
            "done": ((steps,), np.dtype(np.bool_)),
        }
        for name, (shape, dtype) in expected.items():
            array = getattr(self, name)
            if (array.shape, array.dtype) != (shape, dtype):
                raise InputError(
                    f"{name} has shape {array.shape} and type {array.dtype}; a flight of {steps} "
                    f"steps under these conditions has {shape} and {dtype}"
                )
        low, high = entry.low, entry.high
        assert low is not None and high is not None
        if not ((self.actions >= low) & (self.actions <= high)).all():
            raise InputError(f"actions are not all from {low} to {high}")
        if not np.isfinite(self.rewards).all():
            raise InputError("rewards hold NaN or infinity; give finite numbers")
        if self.done[:-1].any():
            raise InputError("done is true before the last step; write one file for each episode")

    def __len__(self) -> int:
        """Return the number of steps."""
        return len(self.actions)

    def to_bytes(self) -> bytes:
        """Return the content of the file."""
        about = _About(pilot=self.pilot, **self.conditions.model_dump())
        arrays: dict[str, Any] = {name: getattr(self, name) for name in _ARRAYS}
        file = io.BytesIO()
        np.savez_compressed(file, about=about.model_dump_json(), **arrays)
        return file.getvalue()


def read_demonstration(path: Path) -> Demonstration:
    """Read a file strictly.

    Raises:
        InputError: It is damaged, too large, or no demonstration of this version.
    """
    arrays = read_arrays(path)
    try:
        if arrays.keys() != {*_ARRAYS, "about"}:
            raise InputError(f"it does not hold exactly about, {', '.join(_ARRAYS)}")
        about = arrays.pop("about")
        if about.shape or about.dtype.kind != "U":
            raise InputError("its description is no text")
        data = _About.read(parse_json(about.item(), "its description"), "about")
        conditions = data.model_dump(include={*FlightConditions.model_fields})
        return Demonstration(FlightConditions.read(conditions), pilot=data.pilot, **arrays)
    except InputError as error:
        raise InputError(
            f"{path} can't be used as a demonstration ({error}); remove the file or record again"
        ) from None


def read_demonstrations(
    folder: str | Path, conditions: FlightConditions | None = None
) -> list[Demonstration]:
    """Read all demonstrations of a folder, in the order in which they were recorded.

    Args:
        folder: Folder with files that `add_demonstration` has written.
        conditions: Those of the training that learns from them, if they must be the same.

    Raises:
        InputError: There are none, or one is unusable or was recorded under other conditions.
    """
    folder = as_path(folder, "folder")
    try:
        refuse_links(folder, depth=1)
    except OSError as error:
        raise InputError(
            f"demonstrations={folder} can't be read ({error.strerror}); give a folder of recorded "
            "flights"
        ) from None
    paths = sorted(folder.glob("*.npz"), key=lambda path: (len(path.name), path.name))
    if not 1 <= len(paths) <= MOST_DEMONSTRATIONS:
        raise InputError(
            f"demonstrations={folder} holds {len(paths)} files *.npz; give a folder with 1 to "
            f"{MOST_DEMONSTRATIONS} recorded flights"
        )
    demonstrations = []
    for path in paths:
        demonstration = read_demonstration(path)
        if conditions is not None:
            demonstration.conditions.check_same(conditions, str(path))
        demonstrations.append(demonstration)
    return demonstrations


def add_demonstration(folder: str | Path, demonstration: Demonstration) -> Path:
    """Write a demonstration to a new file of a folder, atomically; return its path.

    The files are numbered from flight_00000.npz. Several processes may write to the folder.

    Raises:
        InputError: It is no demonstration, or the folder can't be made or stays locked.
        OSError: The file can't be written.
    """
    Instance(Demonstration).read(demonstration, "demonstration")
    folder, content = as_path(folder, "folder"), demonstration.to_bytes()
    make_folder(folder)
    with folder_lock(folder, patience_s=_PATIENCE_S):
        path = folder / f"flight_{_next_number(folder):05d}.npz"
        write_atomically(path, content)
    return path


def _next_number(folder: Path) -> int:
    """Return the number of the next file in a folder, which may not exist yet."""
    names = (_NAME.fullmatch(path.name) for path in folder.glob("*"))
    return max((int(name[1]) for name in names if name), default=-1) + 1


def record_oracle(
    folder: str | Path,
    settings: TrainSettings | None = None,
    *,
    flights: int = 30,
    seed: int = 0,
    **changes: Any,
) -> list[Path]:
    """Record flights of the task's oracle, which acts by the true state.

    Args:
        folder: Folder of the demonstrations; new flights are added to it.
        settings: Settings of the training that learns from them; the defaults if None.
        flights: Number of episodes, which are simulated and rendered together. They differ from
            those already in the folder, even with the same seed.
        seed: Root of the environments' random streams.
        changes: Settings of the training by name, as in `record_oracle("outputs/a", task=task)`.

    Returns:
        The paths of the new files.

    Raises:
        InputError: A setting is unusable, or the task has no oracle, or none for these actions.
        OSError: A file can't be written.
    """
    settings = from_arguments(TrainSettings, settings, changes, record_oracle)
    folder = as_path(folder, "folder")
    flights = Whole(1).read(flights, "flights")
    env = DroneEnv(
        flights,
        settings.task,
        settings.camera,
        seed=seed,
        first_world=_next_number(folder),
        device=settings.device,
        dynamics=settings.dynamics,
        actions=settings.actions,
        renderer=settings.renderer,
        appearance=settings.appearance,
    )
    with closing(env):
        worlds, actions = env.worlds, env.worlds.dynamics.actions
        oracle = make_baseline("oracle", worlds.task, actions, torch.Generator())
        batch: Any = rollout(Recording(oracle), env, flights, keep=None).steps
    conditions, paths = FlightConditions.of(settings), []
    for number in range(flights):
        steps = batch[batch["collector", "traj_ids"] == number]
        demonstration = Demonstration(
            conditions,
            images=steps["pixels"].numpy(),
            actions=steps["action"].numpy(),
            rewards=steps["next", "reward"][:, 0].numpy(),
            done=steps["next", "done"][:, 0].numpy(),
            pilot="oracle",
        )
        paths.append(add_demonstration(folder, demonstration))
    return paths


def _text(value: Any) -> str:
    """Return a setting's value for a message."""
    if isinstance(value, list):
        return f"[{', '.join(_text(item) for item in value)}]"
    return "absent" if value is None else shown(value).strip("'")
