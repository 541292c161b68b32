"""Class model visualization (section 5.2, Eq. 18): the picture that an action is waiting for."""

import dataclasses
import itertools
from typing import Any, Literal

import torch
from torch import Tensor
from torch.nn import functional

from drone_rl.policies import PolicyNetwork
from drone_rl.utils.errors import InputError


@dataclasses.dataclass(frozen=True, kw_only=True)
class ClassModelSettings:
    """How the picture is sought; the defaults are those that a search starts from.

    Raises:
        InputError: A value is out of range.
    """

    objective: Literal["probability", "logit"] = "logit"
    """What is driven up: the action's probability (Eq. 18), or its logit less the others' mean."""
    parameterisation: Literal["pixel", "fourier"] = "pixel"
    """Steps on the pixels, or on their Fourier coefficients, low frequencies first."""
    steps: int = 64
    """Steps of gradient ascent."""
    lr: float = 20.0
    """Length of a step; of the whole picture (pixel) or Adam's rate times 400 (fourier)."""
    normalise: bool = True
    """Give the picture the data set's mean and deviation between steps (as the chapter does)."""
    blur: float = 0.6
    """Deviation of a Gaussian blur between steps, pixels; 0 for none."""
    jitter: int = 1
    """Shift the picture by up to so many pixels before each gradient; 0 for none."""
    total_variation: float = 0.0
    """Weight of the penalty on differences between neighbouring pixels."""
    starts: int = 8
    """Random starts that are averaged."""

    def __post_init__(self) -> None:
        """Refuses what can't be run."""
        if self.objective not in ("probability", "logit"):
            raise InputError(f"objective={self.objective!r} is unknown; give probability or logit")
        if self.parameterisation not in ("pixel", "fourier"):
            raise InputError(
                f"parameterisation={self.parameterisation!r} is unknown; give pixel or fourier"
            )
        if self.steps < 1 or self.starts < 1 or not self.lr > 0:
            raise InputError(
                f"steps={self.steps}, starts={self.starts} and lr={self.lr} must be above 0"
            )
        if min(self.blur, self.jitter, self.total_variation) < 0:
            raise InputError(
                f"blur={self.blur}, jitter={self.jitter} and total_variation="
                f"{self.total_variation} must be 0 or more"
            )


@dataclasses.dataclass
class ClassModel:
    """One picture an action, averaged over the random starts."""

    pictures: Tensor  # (num_actions, C, H, W)
    """As the policy would get them."""
    probabilities: Tensor  # (num_actions,)
    """The policy's probability of the action on its averaged picture."""
    each_start: Tensor  # (num_actions, starts)
    """The same on the picture of each start."""
    roughness: float
    """Mean difference of neighbouring pixels over that of the data set's pictures."""
    settings: ClassModelSettings


@dataclasses.dataclass(frozen=True)
class PictureStatistics:
    """What the data set's pictures are like; the searched-for ones are kept like them."""

    mean: float
    std: float
    low: float
    high: float
    roughness: float

    @classmethod
    def of(cls, observations: Tensor) -> "PictureStatistics":
        """Of pictures (T, C, H, W)."""
        return cls(
            mean=float(observations.mean()),
            std=float(observations.std()),
            low=float(observations.min()),
            high=float(observations.max()),
            roughness=float(_differences(observations).mean()),
        )


def visualise(
    network: PolicyNetwork,
    statistics: PictureStatistics,
    settings: ClassModelSettings,
    *,
    seed: int = 0,
) -> ClassModel:
    """Seeks the picture that makes each action most probable.

    Args:
        network: The policy's; it is left as it is.
        statistics: Of the pictures on which the policy acts.
        settings: How to seek.
        seed: Of the starts and the jitter.
    """
    generator = torch.Generator().manual_seed(seed)
    shape = network.in_shape
    num_actions = int(network.layers[-1].out_features)
    starts = torch.rand(settings.starts, *shape, generator=generator)
    start = statistics.low + (statistics.high - statistics.low) * starts
    pictures = start.repeat(num_actions, 1, 1, 1)
    action = torch.arange(num_actions).repeat_interleave(settings.starts)
    ascend = _ascend_fourier if settings.parameterisation == "fourier" else _ascend_pixels
    found = ascend(network, pictures, action, statistics, settings, generator)
    with torch.no_grad():
        each = network(found).softmax(-1).gather(1, action[:, None])[:, 0]
        average = found.view(num_actions, settings.starts, *shape).mean(1)
        reached = network(average).softmax(-1).diagonal()
    return ClassModel(
        pictures=average,
        probabilities=reached,
        each_start=each.view(num_actions, settings.starts),
        roughness=float(_differences(average).mean()) / max(statistics.roughness, 1e-12),
        settings=settings,
    )


def search(
    network: PolicyNetwork,
    statistics: PictureStatistics,
    objective: Literal["probability", "logit"] = "logit",
    *,
    seed: int = 0,
) -> tuple[ClassModel, list[dict[str, Any]]]:
    """Tries a few settings and keeps the best: probable first, then smooth.

    Choosing settings is "an art" by the chapter's own word; this is a small search in its place.
    A picture's merit is its probability less a tenth for each doubling of its roughness beyond
    that of real pictures.

    Returns:
        The best result, and all that was tried with its figures.
    """
    tried = []
    for parameterisation, blur in itertools.product(("pixel", "fourier"), (0.5, 0.9, 1.4)):
        settings = ClassModelSettings(
            objective=objective, parameterisation=parameterisation, blur=blur
        )
        tried.append(visualise(network, statistics, settings, seed=seed))
    best = max(tried, key=_merit)
    rows = [
        {
            **dataclasses.asdict(result.settings),
            "probabilities": result.probabilities.tolist(),
            "roughness": result.roughness,
            "merit": _merit(result),
            "chosen": result is best,
        }
        for result in tried
    ]
    return best, rows


def _merit(result: ClassModel) -> float:
    rough = torch.tensor(max(result.roughness, 1.0)).log2()
    return float(result.probabilities.mean() - 0.1 * rough)


def _objective(
    network: PolicyNetwork, pictures: Tensor, action: Tensor, settings: ClassModelSettings
) -> Tensor:
    """What each picture should have more of. Shape: (N,)."""
    logits = network(pictures)
    if settings.objective == "probability":
        value = logits.softmax(-1).gather(1, action[:, None])[:, 0]
    else:
        value = (logits - logits.mean(-1, keepdim=True)).gather(1, action[:, None])[:, 0]
    return value - settings.total_variation * _differences(pictures)


def _ascend_pixels(
    network: PolicyNetwork,
    pictures: Tensor,
    action: Tensor,
    statistics: PictureStatistics,
    settings: ClassModelSettings,
    generator: torch.Generator,
) -> Tensor:
    """Steps of a fixed length along the gradient, refined between steps."""
    for _ in range(settings.steps):
        pictures = pictures.detach().requires_grad_()
        value = _objective(network, _jitter(pictures, settings, generator), action, settings)
        (gradient,) = torch.autograd.grad(value.sum(), pictures)
        length = gradient.flatten(1).norm(dim=1).clamp_min(1e-12)
        step = settings.lr * statistics.std / 10 * gradient / length[:, None, None, None]
        pictures = _refine(pictures.detach() + step, statistics, settings)
    return pictures


def _ascend_fourier(
    network: PolicyNetwork,
    pictures: Tensor,
    action: Tensor,
    statistics: PictureStatistics,
    settings: ClassModelSettings,
    generator: torch.Generator,
) -> Tensor:
    """Adam on Fourier coefficients scaled by 1 / frequency, so that broad shapes come first."""
    height, width = pictures.shape[-2:]
    rows = torch.fft.fftfreq(height)[:, None]
    columns = torch.fft.rfftfreq(width)[None]
    scale = 1.0 / (rows**2 + columns**2).sqrt().clamp_min(1.0 / max(height, width))
    noise = (pictures - pictures.mean()) * 0.1
    spectrum = (torch.fft.rfft2(noise) / scale).detach().requires_grad_()
    optimiser = torch.optim.Adam([spectrum], lr=settings.lr / 400)

    def draw() -> Tensor:
        drawn = torch.fft.irfft2(spectrum * scale, s=(height, width))
        return _refine(drawn + statistics.mean, statistics, settings)

    for _ in range(settings.steps):
        value = _objective(network, _jitter(draw(), settings, generator), action, settings)
        optimiser.zero_grad()
        (-value.sum()).backward()
        optimiser.step()
    return draw().detach()


def _refine(
    pictures: Tensor, statistics: PictureStatistics, settings: ClassModelSettings
) -> Tensor:
    """Blurred, given the data set's mean and deviation, and kept within its range."""
    if settings.blur:
        pictures = gaussian_blur(pictures, settings.blur)
    if settings.normalise:
        dims = (1, 2, 3)
        mean, std = pictures.mean(dims, keepdim=True), pictures.std(dims, keepdim=True)
        pictures = (pictures - mean) / (std + 1e-6) * statistics.std + statistics.mean
    return pictures.clamp(statistics.low, statistics.high)


def gaussian_blur(pictures: Tensor, sigma: float) -> Tensor:
    """Blurs pictures (N, C, H, W), with their edges repeated outwards."""
    radius = max(1, round(3 * sigma))
    x = torch.arange(-radius, radius + 1, dtype=pictures.dtype)
    kernel = torch.exp(-(x**2) / (2 * sigma**2))
    kernel = kernel / kernel.sum()
    channels = pictures.shape[1]
    padded = functional.pad(pictures, (radius,) * 4, mode="replicate")
    across = functional.conv2d(
        padded, kernel.view(1, 1, 1, -1).expand(channels, 1, 1, -1), groups=channels
    )
    return functional.conv2d(
        across, kernel.view(1, 1, -1, 1).expand(channels, 1, -1, 1), groups=channels
    )


def _jitter(pictures: Tensor, settings: ClassModelSettings, generator: torch.Generator) -> Tensor:
    if not settings.jitter:
        return pictures
    reach = settings.jitter
    shift = torch.randint(-reach, reach + 1, (2,), generator=generator).tolist()
    padded = functional.pad(pictures, (reach,) * 4, mode="replicate")
    height, width = pictures.shape[-2:]
    top, left = reach + shift[0], reach + shift[1]
    return padded[..., top : top + height, left : left + width]


def _differences(pictures: Tensor) -> Tensor:
    """Mean absolute difference of neighbouring pixels. Shape: (N,)."""
    down = (pictures[..., 1:, :] - pictures[..., :-1, :]).abs().mean((1, 2, 3))
    across = (pictures[..., 1:] - pictures[..., :-1]).abs().mean((1, 2, 3))
    return down + across
