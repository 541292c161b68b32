"""Settings of an explanation."""

from typing import Annotated, Literal

from drone_rl.config import RendererName
from drone_rl.config.values import NumEpisodes, OpenFraction, Seed, Steps
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Real, Whole
from drone_rl.utils.settings import Settings

MIN_EPISODES = 30  # intervals from fewer episodes are too wide to be useful


class ExplainSettings(Settings):
    """Settings of an explanation.

    Raises:
        InputError: A value is out of range.
    """

    frames: Annotated[int, Whole(1, unit="frames")] = 600
    """Frames that are analysed, spread evenly over the episodes of the data set."""
    data_episodes: Annotated[int, Whole(MIN_EPISODES, unit="episodes")] = MIN_EPISODES
    """Least number of complete episodes with sampled actions in the data set."""
    episodes: NumEpisodes = 400
    """Episodes on which the verdict rests."""
    good_share: OpenFraction = 0.9
    """Fraction of the oracle's success rate that a good policy exceeds."""
    layer: str | None = None
    """Layer whose features t-SNE embeds; null for the last one before the logits."""
    grad_cam_layer: str | None = None
    """Layer of Grad-CAM; null for the last convolution's nonlinearity."""
    perplexity: Annotated[float, Real(1.0, unit="neighbours")] = 30.0
    """Perplexity of t-SNE."""
    seed: Seed | None = None
    """Root of all random streams, those of the held-out environments included; null takes a fresh
    one from the operating system, which is printed and recorded."""
    renderer: RendererName = "raytrace"
    """Renderer: raytrace, this package's ray tracer, or mujoco_warp, MuJoCo Warp's."""

    def check(self) -> None:
        """Check that each episode has a frame, and the perplexity."""
        if self.frames < self.data_episodes:
            raise InputError(
                f"frames={self.frames} is less than one for each episode; give "
                f"{self.data_episodes} (data_episodes) or more"
            )
        check_perplexity(self.perplexity, self.frames)


class ClassModelSettings(Settings):
    """Settings of class model visualization (section 5.2). Pixels have the observations' units.

    Raises:
        InputError: A value is out of range.
    """

    maximize: Literal["logit", "probability"] = "logit"
    """Maximized for each action: its probability (Eq. 18), or its logit minus the mean logit."""
    parameterisation: Literal["pixel", "fourier"] = "pixel"
    """What the ascent changes: pixels, or Fourier coefficients divided by their frequency."""
    initial: Literal["random", "constant"] = "random"
    """Initial image: uniformly random pixels, or the mean pixel of the policy's observations."""
    steps: Steps = 64
    """Steps of gradient ascent."""
    step: Literal["length", "plain"] = "length"
    """Step of pixels: lr times the gradient (plain), or along the gradient with a length of lr
    tenths of the observations' standard deviation (length)."""
    lr: Annotated[float, Real(0.0, 1e9, is_above=True)] = 20.0
    """Learning rate, see step; the chapter's example is 20. With fourier, 400 times Adam's."""
    normalize: Literal["match", "training_set", "none"] = "match"
    """After each step: give the image the observations' mean and deviation (match), subtract their
    mean and divide by their deviation as in the chapter (training_set), or neither (none)."""
    blur: Annotated[float, Real(0.0, 100.0, unit="pixels")] = 0.6
    """Standard deviation of a Gaussian blur after each step; 0 for none."""
    clamp: bool = True
    """Whether pixels are clipped to the range of the observations after each step."""
    l2: Annotated[float, Real(0.0, 1e6)] = 0.0
    """Weight of the sum of squared pixels, which is subtracted from the objective."""
    jitter: Annotated[int, Whole(0, 16, "pixels")] = 1
    """Largest random shift of the image before each gradient."""
    starts: Annotated[int, Whole(1, 1000, "images")] = 8
    """Number of random initial images; the best result is shown."""


class ClassModelsSettings(ClassModelSettings):
    """Settings of `drone_rl.class_models`."""

    gallery: bool = False
    """Whether to show the chapter's refinements one after the other instead of these settings."""
    image: str | None = None
    """The policy's input to optimize, an image; null for its first image. Its other inputs have the
    values of frames of the episodes."""
    episodes: Annotated[int, Whole(1, 10_000, "episodes")] = 30
    """Episodes with sampled actions whose observations are the training set."""
    seed: Seed | None = None
    """Root of the random streams; null takes a fresh one from the operating system, which is
    printed and recorded."""


def check_perplexity(perplexity: float, count: int) -> None:
    """Raise InputError if a perplexity is not possible for `count` points."""
    largest = (count - 1) // 3
    if largest < 1:
        raise InputError(f"t-SNE needs 4 or more points, got {count}; record more frames")
    if not 1 <= perplexity <= largest:
        raise InputError(
            f"perplexity={perplexity:g} does not fit {count} points; give 1 to {largest} or "
            "record more frames"
        )
