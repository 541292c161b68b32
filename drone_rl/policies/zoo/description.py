"""Description of a policy: its task, inputs, actions and network, by names and values.

Checkpoints, exported files and run folders contain the same description. It is all that is needed
to build a policy, and all that a file can request.
"""

import functools
import hashlib
import logging
import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self, Unpack

import pydantic
import torch
from annotated_types import MaxLen, MinLen
from torchrl.envs import EnvBase, InitTracker
from torchrl.envs import Transform as TorchrlTransform

from drone_rl.config import (
    COMPUTER_VISION,
    MINIMAL,
    TASKS,
    ActionSettings,
    AppearanceSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
)
from drone_rl.config.dynamics import Axis
from drone_rl.config.inputs import (
    MOST_INPUTS,
    PIXELS,
    ImageInput,
    InputDescription,
    VectorInput,
    describe_inputs,
    first_camera,
    is_plain,
    require_name,
)
from drone_rl.config.networks import Lstm, Network
from drone_rl.config.parts import load_entry_points
from drone_rl.config.registry import own_place
from drone_rl.config.training import TrainSettings
from drone_rl.config.transforms import Fault, Frame, Stack, Transform
from drone_rl.envs import DroneEnv, with_others
from drone_rl.policies import ImageNetwork
from drone_rl.policies.environment import EnvOptions, check_names
from drone_rl.policies.networks import InputsNetwork
from drone_rl.sim.actions import Actions
from drone_rl.sim.dynamics import ComputerVision, Dynamics, make_dynamics
from drone_rl.sim.scenes import load_scene, scene_names
from drone_rl.sim.tasks import Task, as_task
from drone_rl.utils.errors import InputError
from drone_rl.utils.models import Model
from drone_rl.utils.plugins import described, errors_of
from drone_rl.utils.schema import Text, shown
from drone_rl.utils.seeding import Stream, as_global_stream, plain_generator
from drone_rl.utils.settings import Settings

_log = logging.getLogger(__name__)
FORMAT = "drone_rl policy"
FORMAT_VERSION = 3
MAX_PARAMETERS = 2**24
"""Of a network: 64 MiB."""
MAX_NUMBERS = 2**20
"""Of one image after any transform."""
Name = Annotated[str, Text(200)]


class Source(Model):
    """A file from which a task is built, which policy files identify but do not contain."""

    name: Name
    hash: Annotated[str, pydantic.Field(pattern="^[0-9a-f]{64}$")] | None = None
    """SHA-256 of its content."""


def source_of(task: type[BaseTaskSettings]) -> Source | None:
    """Return the user's file that registers a task; None for shipped tasks and notebooks."""
    module = sys.modules.get(task.__module__)
    file = getattr(module, "__file__", None)
    if file is None or task.__module__.partition(".")[0] == "drone_rl":
        return None
    content = Path(file).read_bytes()
    return Source(name=Path(file).name, hash=hashlib.sha256(content).hexdigest())


def scenes_of(task: BaseTaskSettings) -> tuple[Source, ...] | None:
    """Return the scene files of a task; None if it composes its scene.

    Raises:
        InputError: One can't be read.
    """
    files = getattr(task, "scene", None)
    if not files:
        return None
    scenes = [load_scene(file, task.scene_up, task.scene_scale) for file in files]  # type: ignore[attr-defined]
    return tuple(Source(name=scene.path.name[:200], hash=scene.sha256) for scene in scenes)


class TaskDescription(Model):
    """A task: its registered name, its settings, and what else it is built from."""

    name: Name
    parameters: BaseTaskSettings
    """Its settings, those of its reward by default: a policy is judged without it."""
    rewards: dict[Name, float] = {}
    """Weights of the reward's terms in training; empty for a task without terms."""
    scene: Annotated[tuple[Source, ...], MaxLen(16)] | None = None
    """The files of the scenes in training; None for a scene that the task composes."""
    code: Source | None = None
    """The user's file that registers the task; None for a shipped one."""

    @classmethod
    def of(cls, settings: BaseTaskSettings, scene: tuple[Source, ...] | None = None) -> Self:
        """Return the description of a task with some settings; `scene` is that of its files now."""
        terms: Mapping[str, Any] = getattr(settings, "reward", {})
        weights = {name: term.weight for name, term in terms.items()}
        if weights:
            settings = settings.replace(reward=type(settings).model_fields["reward"].default)
        code = source_of(type(settings))
        values = {"parameters": settings, "rewards": weights, "code": code}
        return cls(name=settings.name, scene=scene or scenes_of(settings), **values)

    def changed(self, settings: BaseTaskSettings) -> Self:
        """Return the description with other settings, of training's scenes unless they change."""
        files = [getattr(of, "scene", None) for of in (self.parameters, settings)]
        return self.of(settings, self.scene if files[0] == files[1] else None)

    def check_scenes(self) -> None:
        """Warn about scene files that are not those of the training.

        Raises:
            InputError: One is missing, or can't be read.
        """
        if self.scene is None:
            return
        files = self.parameters.scene  # type: ignore[attr-defined]
        for file in files:
            if not (Path(file).exists() or file in scene_names()):
                raise InputError(
                    f"scene={file}, the scene of this policy's training, is not there; give its "
                    "path, task.scene=PATH"
                )
        for file, known, now in zip(
            files, self.scene, scenes_of(self.parameters) or (), strict=True
        ):
            if known.hash != now.hash:
                _warn_of_change(file, str(known.hash), str(now.hash))

    @pydantic.model_validator(mode="before")
    @classmethod
    def _require_file(cls, values: Any) -> Any:
        match values:
            case {"name": str(name), "code": Mapping() as code} if name not in TASKS:
                load_entry_points()
                file = Source.read(code).name
                if name not in TASKS:
                    raise InputError(
                        f"name={shown(name)} is a task of {shown(file)}, which is not imported; "
                        "give plugins= with its path, or import it in Python"
                    )
        return values

    @pydantic.field_validator("parameters", mode="before")
    @classmethod
    def _of_named_task(cls, values: Any, info: pydantic.ValidationInfo) -> Any:
        if isinstance(values, BaseTaskSettings):
            return values
        if not isinstance(values, Mapping):
            raise InputError("it must be a mapping from names to values")
        return {**values, "name": info.data.get("name")}

    @pydantic.field_serializer("parameters")
    def _without_name(self, parameters: BaseTaskSettings) -> dict[str, Any]:
        values = Settings.values(parameters)
        return {name: value for name, value in values.items() if name != "reward"}

    @pydantic.model_validator(mode="after")
    def _check(self) -> Self:
        count = len(getattr(self.parameters, "scene", None) or ())
        if count != len(self.scene or ()):
            raise InputError(
                f"scene names {len(self.scene or ())} files, but parameters.scene {count}; earlier "
                "versions named none: train the policy again"
            )
        if self.code is not None and self.code != source_of(type(self.parameters)):
            _log.warning(
                "%s, which registers task=%s, is not the file of this policy's training; it is "
                "judged by the rules of the present one",
                self.code.name,
                self.name,
            )
        return self


@functools.cache
def _warn_of_change(file: str, known: str, now: str) -> None:
    """Log a changed scene once."""
    _log.warning(
        "scene=%s has changed since this policy's training (its hash was %.8s, now %.8s); "
        "results are of the present scene",
        file,
        known,
        now,
    )


class ActionSpace(Model):
    """The actions: what builds them, and their axes for other programs."""

    settings: ActionSettings
    axes: tuple[Axis, ...]

    @classmethod
    def of(cls, settings: ActionSettings) -> Self:
        """Return the action space of some settings."""
        return cls(settings=settings, axes=settings.axes)

    @pydantic.model_validator(mode="after")
    def _check(self) -> Self:
        if self.axes != self.settings.axes:
            raise InputError("axes are not those of the settings; write the file again")
        return self


class PolicyDescription(Model):
    """Task, inputs, actions and network of a policy; in bounds, and its parts fit together.

    Raises:
        InputError: They don't fit, or together exceed a bound.
    """

    format: Literal["drone_rl policy"] = FORMAT
    format_version: Literal[3] = FORMAT_VERSION
    task: TaskDescription
    inputs: Annotated[dict[Name, InputDescription], MinLen(1), MaxLen(MOST_INPUTS)]
    """By name, as the `Observer` returns them."""
    actions: ActionSpace
    network: Annotated[Network, pydantic.BeforeValidator(require_name)]
    appearance: AppearanceSettings = MINIMAL
    """Appearance of the scenes in training."""
    dynamics: DynamicsSettings = COMPUTER_VISION
    """The vehicle dynamics in training."""

    @pydantic.field_validator("format_version", mode="before")
    @classmethod
    def _refuse_former(cls, version: Any) -> Any:
        if version == FORMAT_VERSION - 1:
            raise InputError("it is a former layout; convert the file: drone-rl convert FILE")
        return version

    @pydantic.model_validator(mode="after")
    def _check(self) -> Self:
        """Check that it can be built with bounded memory."""
        self.dynamics.check_air()
        self.shapes  # noqa: B018 (checks them)
        expected = self.expected_weights()
        count = sum(value.numel() for value in expected.values())
        if count > MAX_PARAMETERS:
            raise InputError(
                f"the network has {count} parameters; give sizes that make at most {MAX_PARAMETERS}"
            )
        return self

    @property
    def images(self) -> dict[str, ImageInput]:
        """The images among the inputs, by name."""
        return {n: i for n, i in self.inputs.items() if isinstance(i, ImageInput)}

    @property
    def camera(self) -> CameraSettings:
        """The camera of the first image; the default one without images."""
        return first_camera(self.inputs)

    @property
    def transforms(self) -> tuple[Transform, ...]:
        """The transforms of the first image; none without images."""
        return next((image.transforms for image in self.images.values()), ())

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shape of each input as the network gets it, see `shapes_of`."""
        return shapes_of(self.inputs)

    @property
    def sees_pixels(self) -> bool:
        """Whether its only input is the image that `camera` and `transforms` describe."""
        return is_plain(self.inputs)

    @property
    def frames(self) -> int:
        """Number of frames of an image that the network gets at once."""
        stacks = [[t.N for t in i.transforms if isinstance(t, Stack)] for i in self.images.values()]
        return max(map(math.prod, stacks), default=1)

    @property
    def is_recurrent(self) -> bool:
        """Whether the network remembers earlier frames of an episode."""
        return isinstance(self.network, Lstm)

    @property
    def faults(self) -> tuple[str, ...]:
        """Names of the transforms that simulate camera faults."""
        return tuple(t.name for t in self.transforms if isinstance(t, Fault))

    def without_faults(self) -> Self:
        """Return the same description without camera faults."""
        return self.replace(inputs={n: seen.without_errors() for n, seen in self.inputs.items()})

    def build_env(
        self,
        num_envs: int,
        *,
        seed: int,
        device: str,
        stream: Stream = Stream.WORLDS,
        task: Task[Any] | None = None,
        **options: Unpack[EnvOptions],
    ) -> EnvBase:
        """Build environments with the described camera and transforms; see `DroneEnv`.

        `task` is the same task with other starts of episodes. Without `pixels`: no transforms.
        """
        check_names(self.build_env, options)
        self.task.check_scenes()
        parts: Any = {"appearance": self.appearance, **options}
        parts["dynamics"] = options.get("dynamics") or self.dynamics
        if isinstance(parts["dynamics"], DynamicsSettings):  # others have actions of their own
            parts.setdefault("actions", self.actions.settings)
        transforms = self.make_transforms() if options.get("pixels", True) else ()
        env = DroneEnv(
            num_envs,
            task or self.task.parameters,
            self.camera,
            transforms=transforms,
            inputs=None if self.sees_pixels else self.inputs,
            seed=seed,
            stream=stream,
            device=device,
            **parts,
        )
        return with_others(env, transforms)

    def make_dynamics(self) -> Dynamics:
        """Return the vehicle dynamics."""
        task = self.task.parameters
        default = as_task(task).make_dynamics if not self.task.scene else None
        if default is None:  # its scene may be missing, which task.scene=PATH then replaces
            default = functools.partial(ComputerVision, task.step_length)  # type: ignore[attr-defined]
        return make_dynamics(default, self.dynamics, self.actions.settings)

    def make_transforms(self) -> list[TorchrlTransform]:
        """Build the transforms in order, then those that carry the state of a recurrent network."""
        made = [transform.make() for transform in self.transforms]
        if not self.is_recurrent:
            return made
        network: Any = self._without_weights()
        return [*made, InitTracker(), network.lstm.make_tensordict_primer()]

    def build_network(self, generator: torch.Generator | None = None) -> ImageNetwork:
        """Return the network with fresh weights, from torch's global generator by default."""
        actions = self.make_dynamics().actions
        return self._checked(self._network(actions, generator), actions.num_outputs)

    def load_network(self, weights: Mapping[str, torch.Tensor]) -> ImageNetwork:
        """Return the network, in evaluation mode, with given weights, as in `expected_weights`."""
        if own_place(self.network):  # may hold tensors that are no weights, and so not on meta
            network = self._network(self.make_dynamics().actions, torch.Generator())
        else:
            network = self._without_weights()
        copies = {name: weight.to("cpu", copy=True) for name, weight in weights.items()}
        network.load_state_dict(copies, assign=True)  # `to_empty` imports sympy: 0.3 s
        return self._checked(network, network.actions.num_outputs).eval()

    def build_critic(self, generator: torch.Generator | None = None) -> ImageNetwork:
        """Return a network of the same kind with one output, see `build_network`."""
        return self._checked(self._layers(1, generator), 1)

    def expected_weights(self) -> dict[str, torch.Tensor]:
        """Return meta tensors with the names, shapes and types of the network's weights."""
        return dict(self._without_weights().state_dict())

    def _without_weights(self) -> ImageNetwork:
        actions = self.make_dynamics().actions
        with torch.device("meta"):  # names, shapes and types only
            return self._network(actions)

    def _network(self, actions: Actions, generator: torch.Generator | None = None) -> ImageNetwork:
        network = self._layers(actions.num_outputs, generator)
        network.actions = actions
        return network

    def _layers(self, outputs: int, generator: torch.Generator | None) -> ImageNetwork:
        layers = None if generator is None else plain_generator(generator.initial_seed() + 1)
        with as_global_stream(layers):  # layers draw from it what the generator then replaces
            if self.sees_pixels:
                return self.network.make(self.shapes[PIXELS], outputs, generator=generator)
            return self._joined(outputs, generator)

    def _joined(self, outputs: int, generator: torch.Generator | None) -> ImageNetwork:
        """Return a network of all inputs: the named one's layers for each image, and its trunk."""
        hidden = getattr(self.network, "hidden", None)
        if own_place(self.network) or self.is_recurrent or hidden is None:
            raise InputError(
                f"network={self.network.name} takes pixels alone, and not "
                f"{', '.join(self.inputs)}; give network=small_cnn, original_cnn or mlp"
            )
        networks = {
            name: self.network.make(self.shapes[name], outputs, generator=generator)
            for name in self.images
        }
        return InputsNetwork(self.shapes, networks, outputs, hidden=hidden, generator=generator)

    def _checked(self, network: ImageNetwork, outputs: int) -> ImageNetwork:
        """Return a network; raise an `InputError` if it is the user's own with other outputs."""
        if place := own_place(self.network):
            who, zeros = (
                f"network={self.network.name}: {place}",
                torch.zeros(2, *self.shapes[PIXELS]),
            )
            with torch.enable_grad(), errors_of(f"network={self.network.name}", place):
                outputs_of_zeros: Any = network.eval()(
                    zeros
                )  # with gradients, also numbers that overflow
                network.train()
            _check_returned(outputs_of_zeros, who, zeros, (2, outputs))
            if getattr(network, "num_actions", None) != outputs:
                raise InputError(f'{who} has no last layer "logits" of {outputs} outputs; add it')
        return network


def describe(settings: TrainSettings) -> PolicyDescription:
    """Return the description of a training run's policy; `InputError` for unregistered parts."""
    for part in (settings.network, *settings.transforms):
        if not part.is_known:
            kind = "network" if part is settings.network else "transform"
            where = "network" if part is settings.network else "transforms"
            raise InputError(
                f"{where}._target_={part.target} is not registered, so no file could describe it; "
                f"register it with drone_rl.register_{kind} and give plugins=[MODULE]"
            )
    return PolicyDescription(
        task=TaskDescription.of(settings.task),
        inputs=describe_inputs(settings.inputs, settings.camera, settings.transforms),
        actions=ActionSpace.of(settings.actions),
        network=settings.network,
        appearance=settings.appearance,
        dynamics=settings.dynamics,
    )


def shapes_of(inputs: Mapping[str, ImageInput | VectorInput]) -> dict[str, tuple[int, ...]]:
    """Return the shape of each input as a network gets it: (C, H, W) of an image, (n,) of a vector.

    Raises:
        InputError: An image is too large, or still bytes.
    """
    return {
        name: _frame_of(seen).shape if isinstance(seen, ImageInput) else (seen.size,)
        for name, seen in inputs.items()
    }


def _frame_of(image: ImageInput) -> Frame:
    """Return shape and type of an image after its transforms."""
    frame = image.frame
    for transform in image.transforms:
        frame = output_of(transform, frame)
        if math.prod(frame.shape) > MAX_NUMBERS:
            raise InputError(
                f"the transform {transform.name} makes images of shape {frame.shape}; give "
                f"sizes that make at most {MAX_NUMBERS} numbers"
            )
    if not frame.is_float:
        raise InputError("the network needs floats; add a transform such as gray")
    return frame


def output_of(transform: Transform, frame: Frame) -> Frame:
    """Return shape and type of an image after a transform; see `Transform.output` for errors."""
    stated, place = transform.output(frame), own_place(transform)
    if stated is not None and not place:
        return stated
    images = (torch.arange(2 * math.prod(frame.shape), device="cpu") % 255 + 1).to(torch.uint8)
    images = images.reshape(2, *frame.shape)
    images = images.float() / 255 if frame.is_float else images
    what = f"transform={transform.name}"
    with errors_of(what, place), torch.device("cpu"):  # also where weights are meta tensors
        made: Any = transform.make()
        after: Any = made._apply_transform(images)
    shape = stated.shape if stated else getattr(after, "shape", ())[1:]
    wanted = (2, *shape) if len(shape) == 3 else "(2, C, H, W)"
    _check_returned(after, f"{what}: {place}", images, wanted)
    if after.dtype == torch.float64 or not bool(after.isfinite().all()):
        fault = "float64" if after.dtype == torch.float64 else "values that are not finite"
        raise InputError(f"{what}: {place} returns {fault}; return finite numbers of type float32")
    return Frame(tuple(after.shape[1:]), after.is_floating_point())


def _check_returned(output: Any, who: str, images: torch.Tensor, wanted: Any) -> None:
    """Raise an `InputError` about `who` if it returned no tensor of the wanted shape."""
    if not isinstance(output, torch.Tensor) or tuple(output.shape) != wanted:
        raise InputError(
            f"{who} returns {described(output)} for input of shape {tuple(images.shape)}; return a "
            f"tensor of shape {wanted}"
        )
