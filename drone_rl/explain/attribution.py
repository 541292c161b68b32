"""Where in the picture a policy looks: Grad-CAM (section 5.3) and others, by Captum."""

import dataclasses
from collections.abc import Callable
from typing import Literal

import torch
from captum.attr import IntegratedGradients, LayerGradCam, Occlusion, Saliency
from torch import Tensor
from torch.nn import functional

from drone_rl.explain.hooks import find_layer, spatial_layers
from drone_rl.policies import PolicyNetwork
from drone_rl.utils.errors import InputError

Objective = Literal["probability", "logit"]
BATCH = 256
"""Pictures in one call, which bounds the memory."""
INTEGRATION_STEPS = 16
MapMethod = Callable[[Tensor, Tensor], Tensor]
"""Pictures (T, C, H, W) and an action each (T,) to heat maps (T, H, W), 0 or more."""


def grad_cam(activations: Tensor, gradients: Tensor) -> Tensor:
    """Eqs. 19 and 20 as written.

    Args:
        activations: Feature maps A. Shape: (T, K, h, w).
        gradients: Derivative of what is explained by A. Shape: (T, K, h, w).

    Returns:
        ReLU of the feature maps' sum, weighted by their mean derivatives. Shape: (T, h, w).
    """
    weights = gradients.mean((2, 3), keepdim=True)
    return (weights * activations).sum(1).relu()


@dataclasses.dataclass
class Explainer:
    """Heat maps of one policy by several methods, all of the size of its pictures."""

    network: PolicyNetwork
    absent: Tensor
    """What stands for "nothing there": the scene without cubes. Shape: (C, H, W)."""
    layer: str | None = None
    """The layer that Grad-CAM looks at; the last convolution's nonlinearity by default."""

    def __post_init__(self) -> None:
        """Finds the layer.

        Raises:
            InputError: It isn't one with a feature map.
        """
        spatial = spatial_layers(self.network)
        if self.layer is None:
            self.layer = spatial[-1] if spatial else None
            return
        find_layer(self.network, self.layer)
        if self.layer not in spatial:
            have = ", ".join(spatial) or "none, for the policy has no convolution"
            raise InputError(f"layer={self.layer} has no feature map; those that do: {have}")

    def methods(self) -> dict[str, MapMethod]:
        """All methods that this policy allows, by name."""
        maps: dict[str, MapMethod] = {}
        if self.layer is not None:
            maps["grad_cam"] = lambda x, a: self.grad_cam(x, a, "probability")
            maps["grad_cam_logit"] = lambda x, a: self.grad_cam(x, a, "logit")
        maps["saliency"] = self.saliency
        maps["integrated_gradients"] = self.integrated_gradients
        maps["occlusion"] = self.occlusion
        return maps

    def grad_cam(
        self, observations: Tensor, actions: Tensor, objective: Objective = "probability"
    ) -> Tensor:
        """Grad-CAM of the chosen actions, enlarged to the picture. Shape: (T, H, W).

        Raises:
            InputError: The policy has no convolution.
        """
        if self.layer is None:
            raise InputError("Grad-CAM needs a convolution, and this policy has none")
        method = LayerGradCam(self._forward(objective), find_layer(self.network, self.layer))

        def attribute(x: Tensor, a: Tensor) -> Tensor:
            coarse = method.attribute(x, target=a, relu_attributions=True)
            return functional.interpolate(coarse, x.shape[-2:], mode="bilinear")

        return _in_batches(attribute, observations, actions)

    def saliency(self, observations: Tensor, actions: Tensor) -> Tensor:
        """Size of the probability's derivative by each pixel. Shape: (T, H, W)."""
        method = Saliency(self._forward("probability"))
        return _in_batches(lambda x, a: method.attribute(x, target=a), observations, actions)

    def integrated_gradients(self, observations: Tensor, actions: Tensor) -> Tensor:
        """Size of the path integral from the empty scene to the picture. Shape: (T, H, W)."""
        method = IntegratedGradients(self._forward("probability"))

        def attribute(x: Tensor, a: Tensor) -> Tensor:
            return method.attribute(
                x, self.absent[None], target=a, n_steps=INTEGRATION_STEPS, method="riemann_middle"
            )

        return _in_batches(attribute, observations, actions)

    def occlusion(self, observations: Tensor, actions: Tensor) -> Tensor:
        """Size of the change when a patch becomes the empty scene. Shape: (T, H, W)."""
        method = Occlusion(self._forward("probability"))
        channels, height, width = self.network.in_shape
        patch = (channels, min(height, max(3, height // 5)), min(width, max(3, width // 10)))
        stride = (channels, max(1, patch[1] // 2), max(1, patch[2] // 2))

        @torch.no_grad()
        def attribute(x: Tensor, a: Tensor) -> Tensor:
            return method.attribute(
                x,
                sliding_window_shapes=patch,
                strides=stride,
                baselines=self.absent[None].expand_as(x),
                target=a,
            )

        return _in_batches(attribute, observations, actions)

    def _forward(self, objective: Objective) -> Callable[[Tensor], Tensor]:
        if objective not in ("probability", "logit"):
            raise InputError(f"objective={objective!r} is unknown; give probability or logit")
        if objective == "logit":
            return self.network
        return lambda x: self.network(x).softmax(-1)


def _in_batches(
    attribute: Callable[[Tensor, Tensor], Tensor], observations: Tensor, actions: Tensor
) -> Tensor:
    """Attributions of all pictures, their sizes summed over channels. Shape: (T, H, W)."""
    maps = [
        attribute(x.detach().clone().requires_grad_(), a).detach().abs().sum(1)
        for x, a in zip(observations.split(BATCH), actions.split(BATCH), strict=True)
    ]
    return torch.cat(maps).float()
