"""Section "class_models": observations optimized for each action (section 5.2, Eq. 18)."""

import copy
import dataclasses
import itertools
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Literal

import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from drone_rl.collectors.speedups import accelerated_gradients
from drone_rl.explanations.context import Context, LeftOutError
from drone_rl.explanations.heat_maps import Objective
from drone_rl.explanations.hooks import actions_of
from drone_rl.policies import PictureNetwork
from drone_rl.utils.errors import InputError

OBJECTIVES: tuple[Objective, ...] = ("probability", "logit")
AS_PROBABLE = 0.01
"""Of two observations whose probabilities differ by less, the smoother one is better."""


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Return "class_model"; arrays "class_model_probability", "class_model_logit" (A, C, h, w)."""
    if not context.network.is_differentiable:
        raise LeftOutError(
            "Class models need gradients of the logits with respect to the pixels, and this policy "
            "has none; give it as a torch function of floats, which the transform rgb makes."
        )
    statistics = PictureStatistics.of(context.observations)
    numbers: dict[str, Any] = {
        "statistics": dataclasses.asdict(statistics),
        "channels": context.scenes.channels,
    }
    arrays = {}

    def optimize(objective: Objective) -> ClassModel:
        network = copy.deepcopy(context.network)  # it accumulates gradients
        return search(network, statistics, objective, seed=context.seed.value)

    with ThreadPoolExecutor(len(OBJECTIVES)) as pool:  # a small batch uses one core
        found = dict(zip(OBJECTIVES, pool.map(optimize, OBJECTIVES), strict=True))
    for objective, model in found.items():
        arrays[f"class_model_{objective}"] = model.pictures.numpy()
        numbers[objective] = model.summary()
    return {"class_model": numbers}, arrays


@dataclasses.dataclass(frozen=True, kw_only=True)
class ClassModelSettings:
    """Settings of the optimization.

    Raises:
        InputError: A value is out of range.
    """

    objective: Objective = "logit"
    """What is maximized: the action's probability (Eq. 18), or its logit minus the logits' mean."""
    parameterisation: Literal["pixel", "fourier"] = "pixel"
    """What is optimized: pixels, or their Fourier coefficients scaled by 1 / frequency."""
    steps: int = 64
    """Steps of gradient ascent."""
    lr: float = 20.0
    """Length of a step (pixel), or Adam's learning rate times 400 (fourier)."""
    normalise: bool = True
    """Whether to restore the data set's mean and standard deviation after each step."""
    blur: float = 0.6
    """Standard deviation of a Gaussian blur after each step, pixels; 0 for none."""
    jitter: int = 1
    """Largest random shift before each gradient, pixels; 0 for none."""
    total_variation: float = 0.0
    """Weight of the penalty on differences between neighbouring pixels."""
    starts: int = 8
    """Number of random starts."""

    def __post_init__(self) -> None:
        """Check the values."""
        if self.objective not in OBJECTIVES:
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
class Attempts:
    """Results of one setting from each random start, for each action."""

    pictures: Tensor  # (num_actions, starts, C, H, W)
    """Optimized observations."""
    probabilities: Tensor  # (num_actions, starts)
    """The policy's probability of the action on each of them."""
    roughness: Tensor  # (num_actions, starts)
    """Mean difference of neighbouring pixels, relative to the data set's."""
    settings: ClassModelSettings


@dataclasses.dataclass
class ClassModel:
    """The best optimized observation of each action, and all attempts."""

    tried: list[Attempts]
    """Attempts of each setting, with the same number of starts."""
    chosen: list[tuple[int, int]]
    """Setting and start of each action's best observation; see `best_start`."""

    @property
    def pictures(self) -> Tensor:
        """The best observation of each action. Shape: (num_actions, C, H, W)."""
        return torch.stack([self.tried[i].pictures[a, j] for a, (i, j) in enumerate(self.chosen)])

    @property
    def probabilities(self) -> list[float]:
        """The policy's probability of each action on its best observation."""
        return [float(self.tried[i].probabilities[a, j]) for a, (i, j) in enumerate(self.chosen)]

    def summary(self) -> dict[str, Any]:
        """Return plain values; lists are by action.

        "highest" is the highest probability of all attempts (`starts` times `num_settings`),
        "starts_above_half" the number of attempts above one half. A low "highest" does not show
        that no observation has a high probability.
        """
        every = torch.cat([attempts.probabilities for attempts in self.tried], 1)
        return {
            "probabilities": self.probabilities,
            "roughness": [
                float(self.tried[i].roughness[a, j]) for a, (i, j) in enumerate(self.chosen)
            ],
            "starts": self.tried[0].settings.starts,
            "num_settings": len(self.tried),
            "highest": every.amax(1).tolist(),
            "starts_above_half": (every > 0.5).sum(1).tolist(),
            "tried": [self._row(i) for i in range(len(self.tried))],
        }

    def _row(self, setting: int) -> dict[str, Any]:
        attempts = self.tried[setting]
        pairs = zip(attempts.probabilities, attempts.roughness, strict=True)
        best = [best_start(*pair) for pair in pairs]
        actions = range(len(best))
        return {
            **dataclasses.asdict(attempts.settings),
            "probabilities": [float(attempts.probabilities[a, best[a]]) for a in actions],
            "roughness": [float(attempts.roughness[a, best[a]]) for a in actions],
            "each_start": attempts.probabilities.tolist(),
            "chosen": [a for a in actions if self.chosen[a][0] == setting],
        }


@dataclasses.dataclass(frozen=True)
class PictureStatistics:
    """Statistics of the data set's observations, which optimized ones keep."""

    mean: float
    std: float
    low: float
    high: float
    roughness: float

    @classmethod
    def of(cls, observations: Tensor) -> "PictureStatistics":
        """Return the statistics of observations (T, C, H, W)."""
        return cls(
            mean=float(observations.mean()),
            std=float(observations.std()),
            low=float(observations.min()),
            high=float(observations.max()),
            roughness=float(_differences(observations).mean()),
        )


def best_start(probabilities: Tensor, roughness: Tensor) -> int:
    """Return the start with the highest probability; among similar ones, the smoothest.

    Args:
        probabilities: The policy's probabilities of the action. Shape: (starts,).
        roughness: Shape: (starts,).
    """
    as_probable = probabilities >= probabilities.max() - AS_PROBABLE
    return int(roughness.masked_fill(~as_probable, float("inf")).argmin())


def visualise(
    network: PictureNetwork,
    statistics: PictureStatistics,
    settings: ClassModelSettings,
    *,
    seed: int = 0,
) -> Attempts:
    """Optimize observations for each action from random starts.

    Args:
        network: The policy's network; it is not changed.
        statistics: Statistics of the data set.
        settings: Settings of the optimization.
        seed: Seed of the starts and of the jitter.
    """
    generator = torch.Generator().manual_seed(seed)
    shape = network.in_shape
    num_actions = len(actions_of(network).names)
    starts = torch.rand(settings.starts, *shape, generator=generator)
    start = statistics.low + (statistics.high - statistics.low) * starts
    pictures = start.repeat(num_actions, 1, 1, 1)
    action = torch.arange(num_actions).repeat_interleave(settings.starts)
    ascend = _ascend_fourier if settings.parameterisation == "fourier" else _ascend_pixels
    quick = accelerated_gradients(network, of="pixels") or network
    reached = ascend(quick, pictures, action, statistics, settings, generator)
    with torch.no_grad():
        each = actions_of(network).wish(network(reached)).gather(1, action[:, None])[:, 0]
    by_action = (num_actions, settings.starts)
    return Attempts(
        pictures=reached.view(*by_action, *shape),
        probabilities=each.view(by_action),
        roughness=(_differences(reached) / max(statistics.roughness, 1e-12)).view(by_action),
        settings=settings,
    )


def search(
    network: PictureNetwork,
    statistics: PictureStatistics,
    objective: Objective = "logit",
    *,
    seed: int = 0,
) -> ClassModel:
    """Try a few settings, and keep each action's best observation of all starts."""
    tried = []
    for parameterisation, blur in itertools.product(("pixel", "fourier"), (0.5, 0.9, 1.4)):
        settings = ClassModelSettings(
            objective=objective, parameterisation=parameterisation, blur=blur
        )
        tried.append(visualise(network, statistics, settings, seed=seed))
    probabilities = torch.cat([attempts.probabilities for attempts in tried], 1)
    roughness = torch.cat([attempts.roughness for attempts in tried], 1)
    starts = tried[0].settings.starts
    chosen = [
        divmod(best_start(*pair), starts) for pair in zip(probabilities, roughness, strict=True)
    ]
    return ClassModel(tried, chosen)


def _objective(
    network: nn.Module, pictures: Tensor, action: Tensor, settings: ClassModelSettings
) -> Tensor:
    """Return what is maximized. Shape: (N,)."""
    actions, outputs = actions_of(network), network(pictures)
    if settings.objective == "probability":
        value = actions.wish(outputs).gather(1, action[:, None])[:, 0]
    else:
        scores = actions.scores(outputs)
        value = (scores - scores.mean(-1, keepdim=True)).gather(1, action[:, None])[:, 0]
    return value - settings.total_variation * _differences(pictures)


def _ascend_pixels(
    network: nn.Module,
    pictures: Tensor,
    action: Tensor,
    statistics: PictureStatistics,
    settings: ClassModelSettings,
    generator: torch.Generator,
) -> Tensor:
    """Take steps of a fixed length along the gradient."""
    for _ in range(settings.steps):
        pictures = pictures.detach().requires_grad_()
        value = _objective(network, _jitter(pictures, settings, generator), action, settings)
        (gradient,) = torch.autograd.grad(value.sum(), pictures)
        length = gradient.flatten(1).norm(dim=1).clamp_min(1e-12)
        step = settings.lr * statistics.std / 10 * gradient / length[:, None, None, None]
        pictures = _refine(pictures.detach() + step, statistics, settings)
    return pictures


def _ascend_fourier(
    network: nn.Module,
    pictures: Tensor,
    action: Tensor,
    statistics: PictureStatistics,
    settings: ClassModelSettings,
    generator: torch.Generator,
) -> Tensor:
    """Run Adam on Fourier coefficients scaled by 1 / frequency, so that large shapes come first."""
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
    """Blur, restore the data set's mean and standard deviation, and clip to its range."""
    if settings.blur:
        pictures = gaussian_blur(pictures, settings.blur)
    if settings.normalise:
        dims = (1, 2, 3)
        mean, std = pictures.mean(dims, keepdim=True), pictures.std(dims, keepdim=True)
        pictures = (pictures - mean) / (std + 1e-6) * statistics.std + statistics.mean
    return pictures.clamp(statistics.low, statistics.high)


def gaussian_blur(pictures: Tensor, sigma: float) -> Tensor:
    """Blur images (N, C, H, W) with replicated edges."""
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
    """Return the mean absolute difference of neighbouring pixels. Shape: (N,)."""
    down = (pictures[..., 1:, :] - pictures[..., :-1, :]).abs().mean((1, 2, 3))
    across = (pictures[..., 1:] - pictures[..., :-1]).abs().mean((1, 2, 3))
    return down + across
