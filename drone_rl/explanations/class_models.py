"""Class model visualization (section 5.2, Eq. 18): the picture that an action is waiting for."""

import copy
import dataclasses
import itertools
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Literal

import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from drone_rl.collectors.speedups import accelerated_gradients
from drone_rl.explanations.context import Context, LeftOutError
from drone_rl.explanations.heat_maps import Objective
from drone_rl.explanations.hooks import actions_of
from drone_rl.policies import PictureNetwork
from drone_rl.utils.errors import InputError

AS_PROBABLE = 0.01
"""Difference in probability below which the smoother of two pictures is the better one."""


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
    """Random starts, of which the best is shown."""

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
class Attempts:
    """What one setting made of each random start, for each action."""

    pictures: Tensor  # (num_actions, starts, C, H, W)
    """As the policy would get them."""
    probabilities: Tensor  # (num_actions, starts)
    """The policy's probability of the action on each picture."""
    roughness: Tensor  # (num_actions, starts)
    """Mean difference of neighbouring pixels over that of the data set's pictures."""
    settings: ClassModelSettings


@dataclasses.dataclass
class ClassModel:
    """For each action the best of all pictures that were made, and all that was tried."""

    tried: list[Attempts]
    """With the same number of starts each."""
    chosen: list[tuple[int, int]]
    """The setting and the start of each action's picture; see `best_start`."""

    @property
    def pictures(self) -> Tensor:
        """Shape: (num_actions, C, H, W)."""
        return torch.stack([self.tried[i].pictures[a, j] for a, (i, j) in enumerate(self.chosen)])

    @property
    def probabilities(self) -> list[float]:
        """The policy's probability of each action on the very picture shown."""
        return [float(self.tried[i].probabilities[a, j]) for a, (i, j) in enumerate(self.chosen)]

    def summary(self) -> dict[str, Any]:
        """Plain values; lists are by action.

        "highest" is the highest probability that any of the `starts` random starts reached under
        any of the `num_settings` settings, "starts_above_half" in how many of all these attempts
        it was above one half. Of an action with "highest" below x it may be said that none of the
        starts under these settings reached x; that no picture does can't be known.
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


def best_start(probabilities: Tensor, roughness: Tensor) -> int:
    """The start whose picture is most probable; of those about as probable, the smoothest.

    Args:
        probabilities: The policy's of the action. Shape: (starts,).
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
    """Seeks, from each start, the picture that makes each action most probable.

    Args:
        network: The policy's; it is left as it is.
        statistics: Of the pictures on which the policy acts.
        settings: How to seek.
        seed: Of the starts and the jitter.
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
    objective: Literal["probability", "logit"] = "logit",
    *,
    seed: int = 0,
) -> ClassModel:
    """Tries a few settings and keeps, for each action, the best picture of all starts.

    Choosing settings is "an art" by the chapter's own word; this is a small search in its place.
    """
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
    network: PictureNetwork, pictures: Tensor, action: Tensor, settings: ClassModelSettings
) -> Tensor:
    """What each picture should have more of. Shape: (N,)."""
    actions, outputs = actions_of(network), network(pictures)
    if settings.objective == "probability":
        value = actions.wish(outputs).gather(1, action[:, None])[:, 0]
    else:
        scores = actions.scores(outputs)
        value = (scores - scores.mean(-1, keepdim=True)).gather(1, action[:, None])[:, 0]
    return value - settings.total_variation * _differences(pictures)


def _ascend_pixels(
    network: PictureNetwork,
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
    network: PictureNetwork,
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


OBJECTIVES: tuple[Objective, ...] = ("probability", "logit")
"""Of which an action shall have more."""


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "class_model"; arrays "class_model_probability" and "..._logit" (3, C, h, w)."""
    if not context.network.is_differentiable:
        raise LeftOutError(
            "Class models are sought along gradients, and the logits of this policy have none by "
            "the pixels; give it as a torch function of floats, which the transform rgb makes."
        )
    statistics = PictureStatistics.of(context.observations)
    numbers: dict[str, Any] = {
        "statistics": dataclasses.asdict(statistics),
        "channels": context.scenes.channels,
    }
    arrays = {}

    def seek(objective: Objective) -> ClassModel:
        network = copy.deepcopy(context.network)  # gradients are gathered in it
        return search(network, statistics, objective, seed=context.seed.value)

    with ThreadPoolExecutor(len(OBJECTIVES)) as pool:  # steps of small pictures take one core
        found = dict(zip(OBJECTIVES, pool.map(seek, OBJECTIVES), strict=True))
    for objective, model in found.items():
        arrays[f"class_model_{objective}"] = model.pictures.numpy()
        numbers[objective] = model.summary()
    return {"class_model": numbers}, arrays
