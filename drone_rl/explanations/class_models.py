"""Section "class_models": observations optimized for each action (section 5.2, Eq. 18)."""

import copy
import dataclasses
import itertools
from collections.abc import Sequence

import torch
from torch import Tensor
from torch.nn import functional

from drone_rl.acceleration import with_fused_passes
from drone_rl.explanations.context import Context, image, needs
from drone_rl.explanations.hooks import evaluate, rest_in
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


def gradients(context: Context) -> str | None:
    """Need gradients of the logits."""
    return None if context.network.is_differentiable else NO_GRADIENTS


@needs(gradients, image)
def section(context: Context) -> ClassModel:
    """Search the best observation of each action, by probability and by logit."""
    data = context.dataset
    statistics, rest = image_statistics(data.tensor("observations")), rest_in(data.others)
    network = copy.deepcopy(context.network)  # it accumulates gradients

    def best(objective: str) -> BestModels:
        tried = [
            ClassModelSettings(maximize=objective, parameterisation=kind, blur=blur)
            for kind, blur in itertools.product(("pixel", "fourier"), (0.5, 0.9, 1.4))
        ]
        return best_models(network, statistics, tried, seed=context.seed.value, rest=rest)

    return ClassModel(
        statistics=statistics,
        channels=context.scenes.channels,
        probability=best("probability"),
        logit=best("logit"),
    )


def best_models(
    network: ImageNetwork,
    statistics: ImageStatistics,
    tried: Sequence[ClassModelSettings],
    *,
    seed: int = 0,
    rest: Tensor | None = None,
) -> BestModels:
    """Optimize observations for each action with each of the settings; return the best.

    Each start has the other inputs of one of the frames in `rest`, see `hooks`, evenly spread.
    """
    made = [optimize(network, statistics, one, seed=seed, rest=rest) for one in tried]
    images = torch.cat(made, 1)
    actions, flat = range(len(images)), images.flatten(0, 1)
    if rest is not None:
        spread = torch.cat([_spread(rest, one.starts) for one in tried])
        rest = spread.repeat(len(images), 1)
    with torch.no_grad():
        outputs = evaluate(network, flat, rest)
        every = network.actions.probabilities(outputs).unflatten(0, images.shape[:2])
    probabilities = torch.stack([every[action, :, action] for action in actions])
    best = most_probable(probabilities, _differences(flat).view_as(probabilities))
    return BestModels(
        probabilities=tuple(float(probabilities[a, i]) for a, i in enumerate(best)),
        attempts=images.shape[1],
        highest=tuple(probabilities.amax(1).tolist()),
        images=images[actions, best].numpy(),
    )


def most_probable(probabilities: Tensor, roughness: Tensor) -> list[int]:
    """Return each action's most probable image; within `AS_PROBABLE` of it, the smoothest.

    Both arguments have a row for each action. Shape: (num_actions, N).
    """
    less_probable = probabilities < probabilities.amax(1, keepdim=True) - AS_PROBABLE
    return roughness.masked_fill(less_probable, float("inf")).argmin(1).tolist()


def image_statistics(observations: Tensor) -> ImageStatistics:
    """Return the statistics of observations (T, C, H, W)."""
    return ImageStatistics(
        mean=float(observations.mean()),
        std=float(observations.std()),
        low=float(observations.min()),
        high=float(observations.max()),
        roughness=float(_differences(observations).mean()),
    )


def optimize(
    network: ImageNetwork,
    statistics: ImageStatistics,
    settings: ClassModelSettings,
    *,
    seed: int = 0,
    rest: Tensor | None = None,
) -> Tensor:
    """Optimize observations for each action from random starts; the network is not changed.

    For `rest` see `best_models`.

    Returns:
        Shape: (num_actions, starts, C, h, w).
    """
    generator, num_actions = plain_generator(seed), len(network.actions.names)
    start = torch.rand(settings.starts, *network.in_shape, generator=generator)
    start = statistics.low + (statistics.high - statistics.low) * start
    if settings.initial == "constant":
        start = torch.full_like(start, statistics.mean)
    action = torch.arange(num_actions).repeat_interleave(settings.starts)
    quick = with_fused_passes(network, wrt="pixels")
    if rest is not None:
        rest = _spread(rest, settings.starts).repeat(num_actions, 1)
    ascent = _Ascent(quick, action, statistics, settings, generator, rest)
    climb = ascent.pixels if settings.parameterisation == "pixel" else ascent.fourier
    reached = climb(start.repeat(num_actions, 1, 1, 1))
    if not bool(reached.isfinite().all()):
        raise InputError(f"with lr={settings.lr:g} the images diverge; give less, or clamp=true")
    return reached.unflatten(0, (num_actions, settings.starts))


def _spread(rest: Tensor, count: int) -> Tensor:
    """Return `count` rows, evenly spread. Shape: (count, R)."""
    return rest[torch.linspace(0, len(rest) - 1, count).long()]


@dataclasses.dataclass(frozen=True)
class _Ascent:
    """Gradient ascent on images, one for each entry of `action`."""

    network: ImageNetwork
    action: Tensor
    statistics: ImageStatistics
    settings: ClassModelSettings
    generator: torch.Generator
    rest: Tensor | None = None

    def value(self, images: Tensor) -> Tensor:
        """Return the quantity to maximize, on images shifted at random. Shape: (N,)."""
        outputs = evaluate(self.network, self.jitter(images), self.rest)
        actions = self.network.actions
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
