"""Demonstrations: recorded flights that a policy is cloned from, each in a compressed .npz file.

A file contains arrays, see `Demonstration`, and a description in JSON. It may come from an
untrusted source: sizes are checked before memory is allocated, and nothing in it is executed.
"""

import dataclasses
import functools
import io
import re
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
import torch
from annotated_types import MaxLen
from numpy.typing import NDArray

from drone_rl.collectors.complete_episodes import rollout
from drone_rl.config import (
    ActionSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
)
from drone_rl.config.configuration import from_arguments
from drone_rl.config.inputs import (
    MOST_INPUTS,
    PIXELS,
    ImageInput,
    InputDescription,
    describe_inputs,
    first_camera,
    recorded_inputs,
)
from drone_rl.config.training import TrainSettings
from drone_rl.envs import DroneEnv
from drone_rl.envs.readings import reading_form
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
_ARRAYS = ("actions", "rewards", "done")
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
    inputs: Annotated[dict[str, InputDescription], MaxLen(MOST_INPUTS)] = {}
    """What cameras and sensors give, by the names of the policy's inputs; empty for the image of
    `camera` alone."""

    @classmethod
    def of(cls, settings: TrainSettings) -> Self:
        """Return the conditions of a training."""
        Instance(TrainSettings).read(settings, "settings")
        values = {name: getattr(settings, name) for name in cls.model_fields}
        inputs = describe_inputs(settings.inputs, settings.camera, settings.transforms)
        return cls(**{**values, "inputs": recorded_inputs(inputs)})

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
        parts["camera"] = {} if self.inputs else parts["camera"]
        return {f"{part}.{k}": v for part, values in parts.items() for k, v in values.items()}

    @property
    def recorded(self) -> dict[str, Any]:
        """Descriptions of what is recorded, by the names of inputs."""
        return {**(self.inputs or {PIXELS: ImageInput.of(self.camera, ())})}

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
    images: NDArray[np.uint8] | Mapping[str, NDArray[Any]]  # (T, H, W, 3)
    """Images of the policy's camera before each action, RGB; what cameras and sensors give by name,
    see `drone_rl.envs.readings`, if the conditions have inputs."""
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
        self._check_shapes(steps)
        entry = self.conditions.action_entry
        low, high = entry.low, entry.high
        assert low is not None and high is not None
        if not ((self.actions >= low) & (self.actions <= high)).all():
            raise InputError(f"actions are not all from {low} to {high}")
        if not np.isfinite(self.rewards).all():
            raise InputError("rewards hold NaN or infinity; give finite numbers")
        if self.done[:-1].any():
            raise InputError("done is true before the last step; write one file for each episode")

    def _check_shapes(self, steps: int) -> None:
        """Check the arrays' names, shapes and types, and that readings are numbers."""
        entry, recorded = self.conditions.action_entry, self.conditions.recorded
        if self.readings.keys() != recorded.keys():
            names = ", ".join(self.readings)
            raise InputError(f"a flight has {names}; record {', '.join(recorded)}")
        forms = {name: reading_form(seen) for name, seen in recorded.items()}
        expected = {
            **{"images" if n == PIXELS else n: ((steps, *s), t) for n, (t, s) in forms.items()},
            "actions": ((steps, *entry.shape), entry.dtype),
            "rewards": ((steps,), torch.float32),
            "done": ((steps,), torch.bool),
        }
        given = {("images" if n == PIXELS else n): array for n, array in self.readings.items()}
        for name, (shape, dtype) in expected.items():
            array = given[name] if name in given else getattr(self, name)
            wanted = torch.empty(0, dtype=dtype).numpy().dtype
            if (array.shape, array.dtype) != (shape, wanted):
                raise InputError(
                    f"{name} has shape {array.shape} and type {array.dtype}; a flight of {steps} "
                    f"steps under these conditions has {shape} and {wanted}"
                )
        for name, array in given.items():
            if np.isnan(array).any():
                raise InputError(f"{name} holds NaN; give numbers")

    @property
    def readings(self) -> Mapping[str, NDArray[Any]]:
        """What cameras and sensors gave, by the names of inputs. Shapes: (T, *)."""
        return self.images if isinstance(self.images, Mapping) else {PIXELS: self.images}

    def __len__(self) -> int:
        """Return the number of steps."""
        return len(self.actions)

    def to_bytes(self) -> bytes:
        """Return the content of the file."""
        about = _About(pilot=self.pilot, **self.conditions.model_dump())
        arrays: dict[str, Any] = {name: getattr(self, name) for name in _ARRAYS}
        arrays |= {_entry(name): array for name, array in self.readings.items()}
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
        about = arrays.pop("about", np.empty(0))
        if about.shape or about.dtype.kind != "U":
            raise InputError("its description is no text")
        data = _About.read(parse_json(about.item(), "its description"), "about")
        conditions = FlightConditions.read(
            data.model_dump(include={*FlightConditions.model_fields})
        )
        entries = {_entry(name): name for name in conditions.recorded}
        if arrays.keys() != {*_ARRAYS, *entries}:
            raise InputError(f"it does not hold exactly about, {', '.join([*entries, *_ARRAYS])}")
        readings = {name: arrays.pop(entry) for entry, name in entries.items()}
        images = readings if conditions.inputs else readings[PIXELS]
        return Demonstration(conditions, images=images, pilot=data.pilot, **arrays)
    except InputError as error:
        raise InputError(
            f"{path} can't be used as a demonstration ({error}); remove the file or record again"
        ) from None


def _entry(name: str) -> str:
    """Return the name of the array of an input in a file."""
    return "images" if name == PIXELS else f"inputs.{name}"


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
    conditions, paths = FlightConditions.of(settings), []
    inputs = describe_inputs(settings.inputs, settings.camera, settings.transforms)
    clean = {name: seen.without_errors() for name, seen in inputs.items()}
    env = DroneEnv(
        flights,
        settings.task,
        first_camera(inputs),
        inputs=clean if conditions.inputs else None,
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
        batch: Any = rollout(Recording(oracle, readings=True), env, flights, keep=None).steps
    for number in range(flights):
        steps = batch[batch["collector", "traj_ids"] == number]
        images = {name: steps[name].numpy() for name in conditions.recorded}
        demonstration = Demonstration(
            conditions,
            images=images if conditions.inputs else images[PIXELS],
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
