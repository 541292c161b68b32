"""Settings of an explanation."""

from typing import Annotated

from drone_rl.config import RendererName
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
    episodes: Annotated[int, Whole(1, unit="episodes")] = 400
    """Episodes on which the verdict rests."""
    good_share: Annotated[float, Real(0.0, 1.0, is_above=True, is_below=True)] = 0.9
    """Fraction of the oracle's success rate that a good policy exceeds."""
    layer: str | None = None
    """Layer whose features t-SNE embeds; null for the last one before the logits."""
    grad_cam_layer: str | None = None
    """Layer of Grad-CAM; null for the last convolution's nonlinearity."""
    perplexity: Annotated[float, Real(1.0, unit="neighbours")] = 30.0
    """Perplexity of t-SNE."""
    seed: Annotated[int, Whole(0)] | None = None
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


def check_perplexity(perplexity: float, count: int) -> None:
    """Raise InputError if a perplexity is not possible for `count` points."""
    largest = (count - 1) // 3
    if not 1 <= perplexity <= largest:
        raise InputError(
            f"perplexity={perplexity:g} does not fit {count} points; give 1 to {largest} or "
            "record more frames"
        )
