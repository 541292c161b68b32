"""Heat maps of a policy's observations: Grad-CAM (section 5.3) and other methods, by Captum."""

import dataclasses
import functools
import itertools
from collections.abc import Callable
from typing import Literal

import torch
from captum.attr import IntegratedGradients, LayerGradCam, Saliency
from torch import Tensor, nn
from torch.nn import functional

from drone_rl.acceleration import with_fused_passes
from drone_rl.explanations.hooks import (
    batches,
    evaluate,
    find_layer,
    probabilities,
    spatial_layers,
)
from drone_rl.explanations.patches import replaced
from drone_rl.policies import ImageNetwork
from drone_rl.utils.errors import InputError

Objective = Literal["probability", "logit"]
BATCH = 256  # observations in one call, which bounds memory
INTEGRATION_STEPS = 64  # with 16, errors of up to 0.7 occur on a steep softmax
MapMethod = Callable[..., Tensor]
"""Observations, actions (T,) and the rest of the inputs, see `hooks`, to maps (T, H, W)."""


@dataclasses.dataclass
class Explainer:
    """Heat maps of one policy by several methods, all of the size of its observations."""

    network: ImageNetwork
    absent: Tensor  # baseline: the observation of the scene without objects. Shape: (C, H, W).
    layer: str | None = None  # layer of Grad-CAM; the last convolution's nonlinearity by default

    def __post_init__(self) -> None:
        """Find the layer, or raise InputError if it has no feature map."""
        spatial = spatial_layers(self.network) if self.network.is_differentiable else []
        if self.layer is None:
            self.layer = spatial[-1] if spatial else None
            return
        find_layer(self.network, self.layer)
        if self.layer not in spatial:
            names = ", ".join(spatial) or "none of this policy"
            raise InputError(f"layer={self.layer} has no feature map; those that do: {names}")

    def methods(self) -> dict[str, MapMethod]:
        """Return all methods that this policy allows, by name."""
        maps: dict[str, MapMethod] = {}
        if self.layer is not None:
            maps["grad_cam"] = self.grad_cam
            maps["grad_cam_logit"] = functools.partial(self.grad_cam, objective="logit")
        if self.network.is_differentiable:
            maps["saliency"] = self.saliency
            maps["integrated_gradients"] = self.integrated_gradients
        maps["occlusion"] = self.occlusion
        return maps

    def grad_cam(
        self,
        observations: Tensor,
        actions: Tensor,
        rest: Tensor | None = None,
        objective: Objective = "probability",
    ) -> Tensor:
        """Return Grad-CAM in the observation's size (T, H, W); raise InputError without a layer."""
        if self.layer is None:
            raise InputError("Grad-CAM needs a convolution with gradients, which this policy lacks")
        method = LayerGradCam(self._forward(objective), find_layer(self.network, self.layer))

        def attribute(x: Tensor, a: Tensor, r: Tensor | None) -> Tensor:
            coarse = method.attribute(x, a, r, relu_attributions=True)
            assert isinstance(coarse, Tensor)  # a tuple only if x is one
            return functional.interpolate(coarse, x.shape[-2:], mode="bilinear")

        return _in_batches(attribute, observations, actions, rest).sum(1)

    def saliency(self, observations: Tensor, actions: Tensor, rest: Tensor | None = None) -> Tensor:
        """Return the absolute gradient of the probability, summed over channels. (T, H, W)."""
        method = Saliency(self._forward("probability"))
        maps = _in_batches(
            lambda x, a, r: method.attribute(x, a, True, r), observations, actions, rest
        )
        return maps.abs().sum(1)

    def integrated_gradients(
        self, observations: Tensor, actions: Tensor, rest: Tensor | None = None
    ) -> Tensor:
        """Return the absolute path integral from the baseline. Shape: (T, H, W)."""
        quick = with_fused_passes(self.network, wrt="pixels")
        method = IntegratedGradients(self._forward("probability", quick))

        def attribute(x: Tensor, a: Tensor, r: Tensor | None) -> Tensor:
            return method.attribute(
                x,
                self.absent[None],
                a,
                r,
                method="riemann_middle",
                n_steps=INTEGRATION_STEPS,
                internal_batch_size=BATCH,
            )

        return _in_batches(attribute, observations, actions, rest).sum(1).abs()

    def occlusion(
        self, observations: Tensor, actions: Tensor, rest: Tensor | None = None
    ) -> Tensor:
        """Return the change of the probability if a patch is replaced by the baseline. (T, H, W).

        Patches overlap by about half; a pixel gets the absolute value of the mean change over the
        patches that cover it.
        """
        height, width = observations.shape[-2:]
        windows = _windows(height, width)
        base = probabilities(self.network, observations, rest)
        before = base.gather(1, actions[:, None])[:, 0]
        change = before.new_zeros(len(before), len(windows))
        absent = self.absent[None].expand_as(observations)
        parts = replaced(self.network, observations, absent, windows, rest)
        for frames, patches, after in parts:
            change[frames, patches] = before[frames] - after[range(len(frames)), actions[frames]]
        covered = windows.flatten(1).float()
        mean = change @ covered / covered.sum(0).clamp_min(1)
        return mean.view(-1, height, width).abs()

    def _forward(
        self, objective: Objective, network: nn.Module | None = None
    ) -> Callable[..., Tensor]:
        actions = self.network.actions
        evaluated = self.network if network is None else network
        make = actions.scores if objective == "logit" else actions.probabilities
        return lambda *inputs: make(evaluate(evaluated, *inputs))


def _in_batches(
    attribute: Callable[..., Tensor], observations: Tensor, actions: Tensor, rest: Tensor | None
) -> Tensor:
    """Return attributions of all observations. Shape: (T, ...), that of `attribute`."""
    parts = batches(BATCH, observations, actions, rest)
    maps = [attribute(x.detach().clone().requires_grad_(), a, r).detach() for x, a, r in parts]
    return torch.cat(maps).float()


def _windows(height: int, width: int) -> Tensor:
    """Return patches that overlap by half and reach all edges. Shape: (N, height, width), bool."""
    tall, wide = (min(n, max(3, n // part)) for n, part in ((height, 5), (width, 10)))
    down, across = max(1, tall // 2), max(1, wide // 2)
    tops = [*range(0, height - tall, down), height - tall]
    lefts = [*range(0, width - wide, across), width - wide]
    windows = torch.zeros(len(tops) * len(lefts), height, width, dtype=torch.bool)
    for window, (top, left) in zip(windows, itertools.product(tops, lefts), strict=True):
        window[top : top + tall, left : left + wide] = True
    return windows
