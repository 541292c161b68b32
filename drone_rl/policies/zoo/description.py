"""Description of a policy: its task, camera, transforms and network, by names and values.

Checkpoints, exported files and run folders contain the same description. It is all that is needed
to build a policy, and all that a file can request.
"""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, Unpack

import torch
from torchrl.envs import EnvBase, InitTracker
from torchrl.envs import Transform as TorchrlTransform

from drone_rl.config import (
    COMPUTER_VISION,
    MINIMAL,
    MOVES_SETTINGS,
    ActionSettings,
    AppearanceSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
)
from drone_rl.config.networks import Lstm, Network
from drone_rl.config.parts import Part, Parts
from drone_rl.config.registry import own_place
from drone_rl.config.training import TrainSettings
from drone_rl.config.transforms import MOST_TRANSFORMS, Fault, Frame, Stack, Transform
from drone_rl.envs import DroneEnv, with_others
from drone_rl.policies import ImageNetwork
from drone_rl.policies.environment import EnvOptions
from drone_rl.sim.actions import Actions
from drone_rl.sim.dynamics import Dynamics, make_dynamics
from drone_rl.sim.tasks import Task, as_task
from drone_rl.utils.errors import InputError
from drone_rl.utils.plugins import described, errors_of
from drone_rl.utils.schema import Plain, Several, as_mapping, shown
from drone_rl.utils.seeding import Stream, as_global_stream, plain_generator
from drone_rl.utils.settings import Settings

FORMAT = "drone_rl policy"
FORMAT_VERSION = 2
MAX_PARAMETERS = 2**24
"""Of a network: 64 MiB."""
MAX_PIXELS = 2**18
"""Of a camera's frame."""
MAX_NUMBERS = 2**20
"""Of one image after any transform."""
_KEYS = ("format", "format_version", "task", "camera", "transforms", "network")
_OPTIONAL: dict[str, tuple[type[Settings], Settings]] = {
    "appearance": (AppearanceSettings, MINIMAL),
    "dynamics": (DynamicsSettings, COMPUTER_VISION),
    "actions": (ActionSettings, MOVES_SETTINGS),
}
"""The keys that may be missing, with what they then mean."""


@dataclasses.dataclass(frozen=True)
class PolicyDescription:
    """Task, camera, transforms and network of a policy; in bounds, and its parts fit together.

    Raises:
        InputError: They don't fit, or together exceed a bound.
    """

    task: BaseTaskSettings
    camera: CameraSettings
    transforms: tuple[Transform, ...]
    """In the order in which they are applied."""
    network: Network
    appearance: AppearanceSettings = MINIMAL
    """Appearance of the scenes; files without it mean the minimal one."""
    dynamics: DynamicsSettings = COMPUTER_VISION
    """The vehicle dynamics; files without it mean computer-vision mode."""
    actions: ActionSettings = MOVES_SETTINGS
    """The action space; files without it mean moves."""

    def __post_init__(self) -> None:
        """Check that it can be built with bounded memory."""
        self.dynamics.check_air()
        pixels = self.camera.width * self.camera.height
        if pixels > MAX_PIXELS:
            raise InputError(f"camera has {pixels} pixels; give at most {MAX_PIXELS}")
        if not self.input.is_float:
            raise InputError("the network needs floats; add a transform such as gray")
        expected = self.expected_weights()
        count = sum(value.numel() for value in expected.values())
        if count > MAX_PARAMETERS:
            raise InputError(
                f"the network has {count} parameters; give sizes that make at most {MAX_PARAMETERS}"
            )

    @property
    def input(self) -> Frame:
        """Shape and type of the network's input."""
        frame = Frame((self.camera.height, self.camera.width, 3))
        for transform in self.transforms:
            frame = output_of(transform, frame)
            if math.prod(frame.shape) > MAX_NUMBERS:
                raise InputError(
                    f"the transform {transform.name} makes images of shape {frame.shape}; give "
                    f"sizes that make at most {MAX_NUMBERS} numbers"
                )
        return frame

    @property
    def frames(self) -> int:
        """Number of frames that the network gets at once."""
        return math.prod(t.N for t in self.transforms if isinstance(t, Stack))

    @property
    def is_recurrent(self) -> bool:
        """Whether the network remembers earlier frames of an episode."""
        return isinstance(self.network, Lstm)

    @property
    def faults(self) -> tuple[str, ...]:
        """Names of the transforms that simulate camera faults."""
        return tuple(t.name for t in self.transforms if isinstance(t, Fault))

    def without_faults(self) -> "PolicyDescription":
        """Return the same description without camera faults."""
        sound = tuple(t for t in self.transforms if not isinstance(t, Fault))
        return dataclasses.replace(self, transforms=sound)

    def as_dict(self) -> dict[str, Any]:
        """Return plain data as in files; `parse` is the inverse."""
        chosen = {name: getattr(self, name) for name in _OPTIONAL}
        special = {n: s.values() for n, s in chosen.items() if s != _OPTIONAL[n][1]}
        return {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "task": self.task.values(),
            "camera": self.camera.values(),
            "transforms": [_as_dict(transform) for transform in self.transforms],
            "network": _as_dict(self.network),
            **special,
        }

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
        parts: Any = {"appearance": self.appearance, **options}
        parts["dynamics"] = options.get("dynamics") or self.dynamics
        if isinstance(parts["dynamics"], DynamicsSettings):  # others have actions of their own
            parts.setdefault("actions", self.actions)
        transforms = self.make_transforms() if options.get("pixels", True) else ()
        env = DroneEnv(
            num_envs,
            task or self.task,
            self.camera,
            transforms=transforms,
            seed=seed,
            stream=stream,
            device=device,
            **parts,
        )
        return with_others(env, transforms)

    def make_dynamics(self) -> Dynamics:
        """Return the vehicle dynamics."""
        return make_dynamics(as_task(self.task).make_dynamics, self.dynamics, self.actions)

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
            return self.network.make(self.input.shape, outputs, generator=generator)

    def _checked(self, network: ImageNetwork, outputs: int) -> ImageNetwork:
        """Return a network; raise an `InputError` if it is the user's own with other outputs."""
        if place := own_place(self.network):
            who, zeros = f"network={self.network.name}: {place}", torch.zeros(2, *self.input.shape)
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
        settings.task,
        settings.camera,
        settings.transforms,
        settings.network,
        **{name: getattr(settings, name) for name in _OPTIONAL},
    )


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


def parse(data: Any) -> PolicyDescription:
    """Read a description from plain data, strictly.

    Raises:
        InputError: A key is missing or unknown, a value has another type or is out of bounds.
    """
    data = as_mapping(data, "the policy's description")
    if data.get("format") != FORMAT:
        raise InputError(f"format={shown(data.get('format'))} is not that of a policy: {FORMAT}")
    version = data.get("format_version")
    if type(version) is not int or version != FORMAT_VERSION:
        raise InputError(
            f"format_version={shown(version)}: this program reads "
            f"{FORMAT_VERSION}; use the version of drone_rl that wrote it"
        )
    if (keys := set(data) - set(_OPTIONAL)) != set(_KEYS):
        names = ", ".join(shown(key) for key in sorted(keys ^ set(_KEYS)))
        raise InputError(
            f"the policy's description needs {', '.join(_KEYS)}; missing or unknown: {names}"
        )
    special: dict[str, Any] = {
        name: of.read(data[name], name) for name, (of, _) in _OPTIONAL.items() if name in data
    }
    parts = (
        data["network"],
        *Several(Plain(), 0, MOST_TRANSFORMS).read(data["transforms"], "transforms"),
    )
    if any("_target_" in as_mapping(part, "a part") for part in parts):
        raise InputError("the policy's description has _target_; files name registered parts alone")
    return PolicyDescription(
        BaseTaskSettings.read(data["task"], "task"),
        CameraSettings.read(data["camera"], "camera"),
        Parts(Transform, MOST_TRANSFORMS).read(data["transforms"], "transforms"),
        Network.read(data["network"], "network"),
        **special,
    )


def _as_dict(part: Part) -> dict[str, Any]:
    return {"name": part.name, **part.values()}
