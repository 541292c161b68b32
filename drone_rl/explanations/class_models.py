"""Section "class_models": observations optimized for each action (section 5.2, Eq. 18)."""

import copy
import dataclasses
import itertools
from collections.abc import Sequence

import torch
from torch import Tensor
from torch.nn import functional

from drone_rl.acceleration import with_fused_passes
from drone_rl.explanations.context import Context, LeftOutError
from drone_rl.explanations.results import BestModels, ClassModel, ImageStatistics
from drone_rl.explanations.settings import ClassModelSettings
from drone_rl.policies import ImageNetwork
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import plain_generator

NO_GRADIENTS = (
    "Class models need gradients of the logits with respect to the pixels, and this policy has "
    "none; give it as a PyTorch function of float images, such as the transform rgb returns."
)
AS_PROBABLE = 0.01  # of observations whose probabilities differ by less, the smoothest is the best


def section(context: Context) -> ClassModel:
    """Search the best observation of each action, by probability and by logit."""
    if not context.network.is_differentiable:
        raise LeftOutError(NO_GRADIENTS)
    statistics = image_statistics(context.dataset.tensor("observations"))
    network = copy.deepcopy(context.network)  # it accumulates gradients

    def best(objective: str) -> BestModels:
        return best_models(search(network, statistics, objective, seed=context.seed.value))

    return ClassModel(
        statistics=statistics,
        channels=context.scenes.channels,
        probability=best("probability"),
        logit=best("logit"),
    )


@dataclasses.dataclass(frozen=True)
class Attempts:
    """Results of one setting from each random start, for each action."""

    images: Tensor  # (num_actions, starts, C, H, W); optimized observations
    probabilities: Tensor  # (num_actions, starts); the policy's, of the action
    roughness: Tensor  # (num_actions, starts); relative to the data set's
    settings: ClassModelSettings

    def best(self) -> list[int]:
        """Return each action's most probable start; within `AS_PROBABLE` of it, the smoothest."""
        highest = self.probabilities.amax(1, keepdim=True)
        less_probable = self.probabilities < highest - AS_PROBABLE
        return self.roughness.masked_fill(less_probable, float("inf")).argmin(1).tolist()

    def best_images(self) -> Tensor:
        """Return the observations of `best`. Shape: (num_actions, C, H, W)."""
        return torch.stack([self.images[a, i] for a, i in enumerate(self.best())])

    def best_values(self) -> dict[str, list[float]]:
        """Return probability and roughness of `best`."""
        return {
            name: [float(getattr(self, name)[a, i]) for a, i in enumerate(self.best())]
            for name in ("probabilities", "roughness")
        }


def best_models(tried: Sequence[Attempts]) -> BestModels:
    """Return the best of attempts with several settings, which have the same number of starts."""
    fields = ("images", "probabilities", "roughness")
    joined = {name: torch.cat([getattr(a, name) for a in tried], 1) for name in fields}
    every = Attempts(**joined, settings=tried[0].settings)
    return BestModels(
        probabilities=tuple(every.best_values()["probabilities"]),
        attempts=every.probabilities.shape[1],
        highest=tuple(every.probabilities.amax(1).tolist()),
        images=every.best_images().numpy(),
    )


def image_statistics(observations: Tensor) -> ImageStatistics:
    """Return the statistics of observations (T, C, H, W)."""
    return ImageStatistics(
        mean=float(observations.mean()),
        std=float(observations.std()),
        low=float(observations.min()),
        high=float(observations.max()),
        roughness=float(_differences(observations).mean()),
    )


def visualise(
    network: ImageNetwork,
    statistics: ImageStatistics,
    settings: ClassModelSettings,
    *,
    seed: int = 0,
) -> Attempts:
    """Optimize observations for each action from random starts; the network is not changed."""
    generator, shape = plain_generator(seed), network.in_shape
    num_actions = len(network.actions.names)
    start = torch.rand(settings.starts, *shape, generator=generator)
    start = statistics.low + (statistics.high - statistics.low) * start
    if settings.initial == "constant":
        start = torch.full_like(start, statistics.mean)
    images = start.repeat(num_actions, 1, 1, 1)
    action = torch.arange(num_actions).repeat_interleave(settings.starts)
    quick = with_fused_passes(network, wrt="pixels")
    ascent = _Ascent(quick, action, statistics, settings, generator)
    optimize = ascent.pixels if settings.parameterisation == "pixel" else ascent.fourier
    reached = optimize(images)
    if not bool(reached.isfinite().all()):
        raise InputError(f"with lr={settings.lr:g} the images diverge; give less, or clamp=true")
    with torch.no_grad():
        each = network.actions.probabilities(network(reached)).gather(1, action[:, None])[:, 0]
    by_action = (num_actions, settings.starts)
    return Attempts(
        images=reached.view(*by_action, *shape),
        probabilities=each.view(by_action),
        roughness=(_differences(reached) / max(statistics.roughness, 1e-12)).view(by_action),
        settings=settings,
    )


def search(
    network: ImageNetwork, statistics: ImageStatistics, objective: str = "logit", *, seed: int = 0
) -> list[Attempts]:
    """Try a few settings, each from all starts."""
    tried = []
    for kind, blur in itertools.product(("pixel", "fourier"), (0.5, 0.9, 1.4)):
        settings = ClassModelSettings(maximize=objective, parameterisation=kind, blur=blur)
        tried.append(visualise(network, statistics, settings, seed=seed))
    return tried


@dataclasses.dataclass(frozen=True)
class _Ascent:
    """Gradient ascent on images, one for each entry of `action`."""

    network: ImageNetwork
    action: Tensor
    statistics: ImageStatistics
    settings: ClassModelSettings
    generator: torch.Generator

    def value(self, images: Tensor) -> Tensor:
        """Return the quantity to maximize, on images shifted at random. Shape: (N,)."""
        actions, outputs = self.network.actions, self.network(self.jitter(images))
        if self.settings.maximize == "probability":
            scores = actions.probabilities(outputs)
        else:
            scores = actions.scores(outputs)
            scores = scores - scores.mean(-1, keepdim=True)
        penalty = self.settings.l2 * images.square().sum((1, 2, 3)) if self.settings.l2 else 0.0
        return scores.gather(1, self.action[:, None])[:, 0] - penalty

    def pixels(self, images: Tensor) -> Tensor:
        """Take steps along the gradient."""
        for _ in range(self.settings.steps):
            images = images.detach().requires_grad_()
            (gradient,) = torch.autograd.grad(self.value(images).sum(), images)
            if self.settings.step == "plain":
                step = self.settings.lr * gradient
            else:
                length = gradient.flatten(1).norm(dim=1).clamp_min(1e-12)
                step = self.settings.lr * self.statistics.std / 10 * gradient
                step = step / length[:, None, None, None]
            images = self.refine(images.detach() + step)
        return images

    def fourier(self, images: Tensor) -> Tensor:
        """Run Adam on coefficients scaled by 1 / frequency, so that large shapes come first."""
        height, width = images.shape[-2:]
        rows = torch.fft.fftfreq(height)[:, None]
        columns = torch.fft.rfftfreq(width)[None]
        scale = 1.0 / (rows**2 + columns**2).sqrt().clamp_min(1.0 / max(height, width))
        noise = (images - images.mean()) * 0.1
        spectrum = (torch.fft.rfft2(noise) / scale).detach().requires_grad_()
        optimizer = torch.optim.Adam([spectrum], lr=self.settings.lr / 400)

        def render() -> Tensor:
            rendered = torch.fft.irfft2(spectrum * scale, s=(height, width))
            return self.refine(rendered + self.statistics.mean)

        for _ in range(self.settings.steps):
            optimizer.zero_grad()
            (-self.value(render()).sum()).backward()
            optimizer.step()
        return render().detach()

    def refine(self, images: Tensor) -> Tensor:
        """Blur, normalize and clip images, as far as the settings say."""
        settings, kept, dims = self.settings, self.statistics, (1, 2, 3)
        images = gaussian_blur(images, settings.blur) if settings.blur else images
        if settings.normalize == "match":
            mean, std = images.mean(dims, keepdim=True), images.std(dims, keepdim=True)
            images = (images - mean) / (std + 1e-6) * kept.std + kept.mean
        elif settings.normalize == "training_set":
            images = (images - kept.mean) / (kept.std + 1e-6)
        return images.clamp(kept.low, kept.high) if settings.clamp else images

    def jitter(self, images: Tensor) -> Tensor:
        """Shift images at random, with edges repeated."""
        reach, (height, width) = self.settings.jitter, images.shape[-2:]
        top, left = torch.randint(0, 2 * reach + 1, (2,), generator=self.generator).tolist()
        padded = functional.pad(images, (reach,) * 4, mode="replicate")
        return padded[..., top : top + height, left : left + width]


def gaussian_blur(images: Tensor, sigma: float) -> Tensor:
    """Blur images (N, C, H, W) with replicated edges."""
    radius = max(1, round(3 * sigma))
    x = torch.arange(-radius, radius + 1, dtype=images.dtype)
    kernel = torch.exp(-(x**2) / (2 * sigma**2))
    kernel = kernel / kernel.sum()
    channels = images.shape[1]
    blurred = functional.pad(images, (radius,) * 4, mode="replicate")
    for shape in ((1, 1, 1, -1), (1, 1, -1, 1)):
        weight = kernel.view(shape).expand(channels, *[-1] * 3)
        blurred = functional.conv2d(blurred, weight, groups=channels)
    return blurred


def _differences(images: Tensor) -> Tensor:
    """Return the mean absolute difference of vertical plus that of horizontal neighbours. (N,)."""
    down = (images[..., 1:, :] - images[..., :-1, :]).abs().mean((1, 2, 3))
    across = (images[..., 1:] - images[..., :-1]).abs().mean((1, 2, 3))
    return down + across
