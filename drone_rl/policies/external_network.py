"""Third-party networks: callables from frames to logits."""

import copy
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor, nn

from drone_rl.config.inputs import PIXELS
from drone_rl.policies.networks import ImageNetwork
from drone_rl.sim.actions import Actions
from drone_rl.utils.errors import InputError
from drone_rl.utils.plugins import described, line_of

Function = Callable[[Any], Any]
"""From a batch of frames, or a dictionary of inputs by name, to logits (N, number of actions), a
tensor or an array."""


class Model(Protocol):
    """A model of Stable-Baselines3."""

    policy: Any

    def get_env(self) -> Any:
        """Return its environment, if any."""


Logits = Function | Model
"""What `policy_from` takes."""
_TOLERANCE = 1e-5
"""Largest difference of the logits of one frame between two calls of a deterministic network."""


class ExternalNetwork(ImageNetwork):
    """A network around a third-party callable; a PyTorch module is copied in evaluation mode.

    Raises:
        InputError: It does not accept such frames, does not return one logit for each action, or
            returns different logits for the same frame.
    """

    def __init__(
        self,
        logits: Function,
        in_shape: tuple[int, ...] | Mapping[str, tuple[int, ...]],
        actions: Actions,
        *,
        takes_bytes: bool = False,
        device: torch.device | str = "cpu",
    ) -> None:
        """Evaluate the callable on one frame to check it.

        Args:
            logits: The callable.
            in_shape: Shape (C, H, W) of one frame, or shapes of inputs by name.
            actions: The action space; it has one action for each logit.
            takes_bytes: Whether it takes RGB bytes (N, H, W, 3) instead of transformed floats.
            device: Device of a torch module.
        """
        super().__init__()
        self.in_shapes = in_shape if isinstance(in_shape, Mapping) else {PIXELS: tuple(in_shape)}
        self.in_keys, self._is_joined = tuple(self.in_shapes), isinstance(in_shape, Mapping)
        images = [shape for shape in self.in_shapes.values() if len(shape) == 3]
        self.in_shape, self.actions = (images or [*self.in_shapes.values()])[0], actions
        self._takes_bytes = takes_bytes
        self._logits = copied(logits).to(device) if isinstance(logits, nn.Module) else logits
        self._logit_factor = torch.ones(self.num_actions, device=device)
        self._logit_bias = torch.zeros(self.num_actions, device=device)
        shapes = self.in_shapes.values()
        sample = [torch.full((1, *shape), 0.5, device=device) for shape in shapes]
        logits_of_sample = self(*sample)
        if not torch.allclose(logits_of_sample, self(*sample), atol=_TOLERANCE):
            raise InputError(
                "the network returned different logits for one image; give a deterministic network"
            )
        self.is_differentiable = _has_gradients(self, sample)

    @property
    def parts(self) -> nn.Module:
        """The torch module; an empty module for other callables."""
        return self._logits if isinstance(self._logits, nn.Module) else nn.Module()

    def forward(self, *inputs: Tensor) -> Tensor:  # pyright: ignore[reportIncompatibleMethodOverride]
        """See `ImageNetwork`; raise an `InputError` if the result is not finite logits."""
        shapes = self.in_shapes.values()
        flat = [values.reshape(-1, *s) for values, s in zip(inputs, shapes, strict=True)]
        outputs = self._outputs(self._given(flat))
        wanted = (len(flat[0]), self.num_actions)
        is_array = isinstance(outputs, Tensor | np.ndarray)
        if not is_array or tuple(outputs.shape) != wanted:
            raise InputError(
                f"the network returned {described(outputs)}; give a callable that returns logits "
                f"of shape {wanted}, one for each of {', '.join(self.actions.output_names)}"
            )
        logits = torch.as_tensor(outputs).to(flat[0].device, flat[0].dtype)
        if not torch.isfinite(logits).all():
            raise InputError("the network returned logits that are not finite; give another one")
        logits = logits * self._logit_factor + self._logit_bias
        batch = inputs[0].shape[: inputs[0].ndim - len(self.in_shapes[self.in_keys[0]])]
        return logits.reshape(*batch, self.num_actions)

    def rescale(self, factor: Tensor, shift: Tensor) -> None:
        """See `ImageNetwork`; the callable itself does not change."""
        self._logit_factor = self._logit_factor * factor
        self._logit_bias = self._logit_bias * factor + shift

    def _outputs(self, given: Any) -> Any:
        try:
            return self._logits(given)
        except InputError:
            raise
        except Exception as error:
            what = " ".join(f"{type(error).__name__}: {error}".split())[:200]
            where = line_of(error) or type(self._logits).__name__
            if isinstance(given, dict):
                shapes = ", ".join(f"{name} {tuple(v.shape)}" for name, v in given.items())
                seen, needed = f"a dictionary of inputs of shapes {shapes}", "inputs="
            else:
                seen = f"images of shape {tuple(given.shape)}, {given.dtype}"
                needed = "camera= and transforms="
            raise InputError(
                f"the network failed in {where} on {seen} ({what}); correct it, give "
                f"drone_rl.policy_from the {needed} that it needs, or network.float() if its "
                "weights are of another type"
            ) from error

    def _given(self, flat: list[Tensor]) -> Tensor | dict[str, Tensor]:
        if self._is_joined:
            return dict(zip(self.in_keys, flat, strict=True))
        if not self._takes_bytes:
            return flat[0]
        return (flat[0] * 255).round().to(torch.uint8).movedim(-3, -1)


def copied(module: nn.Module, memo: dict[int, Any] | None = None) -> nn.Module:
    """Return a copy in evaluation mode; `memo` has what replaces parts, by their `id`."""
    try:
        module_copy = copy.deepcopy(module, memo).eval()
    except Exception as error:
        raise InputError(
            f"the network {type(module).__name__} can't be copied ({type(error).__name__}); give a "
            "function that calls it"
        ) from error
    for part in module_copy.modules():
        if hasattr(part, "inplace"):  # explanations read the outputs of layers
            vars(part)["inplace"] = False
    return module_copy


@torch.enable_grad()
def _has_gradients(network: nn.Module, inputs: list[Tensor]) -> bool:
    """Return whether the logits have gradients by the inputs."""
    inputs = [values.clone().requires_grad_() for values in inputs]
    try:
        logits = network(*inputs)
        if not logits.requires_grad:
            return False
        gradients = torch.autograd.grad(logits.sum(), inputs, allow_unused=True)
    except (InputError, RuntimeError):  # NumPy and DLPack take no tensor that requires gradients
        return False
    return any(gradient is not None for gradient in gradients)
