"""Third-party networks: callables from frames to logits."""

import copy
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor, nn

from drone_rl.policies.networks import ImageNetwork
from drone_rl.sim.actions import Actions
from drone_rl.utils.errors import InputError
from drone_rl.utils.plugins import described, line_of

Function = Callable[[Any], Any]
"""From a batch of frames to logits (N, number of actions), a tensor or an array."""


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
        in_shape: tuple[int, ...],
        actions: Actions,
        *,
        takes_bytes: bool = False,
        device: torch.device | str = "cpu",
    ) -> None:
        """Evaluate the callable on one frame to check it.

        Args:
            logits: The callable.
            in_shape: Shape (C, H, W) of one frame.
            actions: The action space; it has one action for each logit.
            takes_bytes: Whether it takes RGB bytes (N, H, W, 3) instead of transformed floats.
            device: Device of a torch module.
        """
        super().__init__()
        self.in_shape, self.actions = tuple(in_shape), actions
        self._takes_bytes = takes_bytes
        self._logits = copied(logits).to(device) if isinstance(logits, nn.Module) else logits
        self._logit_factor = torch.ones(self.num_actions, device=device)
        self._logit_bias = torch.zeros(self.num_actions, device=device)
        image = torch.full((1, *self.in_shape), 0.5, device=device)
        logits_of_image = self(image)
        if not torch.allclose(logits_of_image, self(image), atol=_TOLERANCE):
            raise InputError(
                "the network returned different logits for one image; give a deterministic network"
            )
        self.is_differentiable = _has_gradients(self, image)

    @property
    def parts(self) -> nn.Module:
        """The torch module; an empty module for other callables."""
        return self._logits if isinstance(self._logits, nn.Module) else nn.Module()

    def forward(self, pixels: Tensor) -> Tensor:
        """See `ImageNetwork`; raise an `InputError` if the result is not finite logits."""
        flat = pixels.reshape(-1, *self.in_shape)
        outputs = self._outputs(self._given(flat))
        wanted = (len(flat), self.num_actions)
        is_array = isinstance(outputs, Tensor | np.ndarray)
        if not is_array or tuple(outputs.shape) != wanted:
            raise InputError(
                f"the network returned {described(outputs)}; give a callable that returns logits "
                f"of shape {wanted}, one for each of {', '.join(self.actions.output_names)}"
            )
        logits = torch.as_tensor(outputs).to(flat.device, flat.dtype)
        if not torch.isfinite(logits).all():
            raise InputError("the network returned logits that are not finite; give another one")
        logits = logits * self._logit_factor + self._logit_bias
        return logits.reshape(*pixels.shape[:-3], self.num_actions)

    def rescale(self, factor: Tensor, shift: Tensor) -> None:
        """See `ImageNetwork`; the callable itself does not change."""
        self._logit_factor = self._logit_factor * factor
        self._logit_bias = self._logit_bias * factor + shift

    def _outputs(self, images: Tensor) -> Any:
        try:
            return self._logits(images)
        except InputError:
            raise
        except Exception as error:
            what = " ".join(f"{type(error).__name__}: {error}".split())[:200]
            where = line_of(error) or type(self._logits).__name__
            raise InputError(
                f"the network failed in {where} on images of shape {tuple(images.shape)}, "
                f"{images.dtype} ({what}); correct it, give drone_rl.policy_from the camera= and "
                "transforms= that it needs, or network.float() if its weights are of another type"
            ) from error

    def _given(self, flat: Tensor) -> Tensor:
        if not self._takes_bytes:
            return flat
        return (flat * 255).round().to(torch.uint8).movedim(-3, -1)


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
def _has_gradients(network: nn.Module, image: Tensor) -> bool:
    """Return whether the logits of an image have gradients by its pixels."""
    image = image.clone().requires_grad_()
    try:
        logits = network(image)
        if not logits.requires_grad:
            return False
        (gradient,) = torch.autograd.grad(logits.sum(), image, allow_unused=True)
    except (InputError, RuntimeError):  # NumPy and DLPack take no tensor that requires gradients
        return False
    return gradient is not None
