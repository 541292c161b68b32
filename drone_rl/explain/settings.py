"""What an explanation computes, checked before anything is computed."""

import dataclasses

from drone_rl.explain import tsne
from drone_rl.utils.errors import InputError

MIN_EPISODES = 30
"""Fewer flights than this tell next to nothing of others."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ExplainSettings:
    """What to compute.

    Raises:
        InputError: A value is out of range.
    """

    frames: int = 600
    """Frames that are analysed, spread evenly over the flights of the data set."""
    data_episodes: int = MIN_EPISODES
    """Whole flights in the data set, at least."""
    episodes: int = 400
    """Episodes on which the verdict rests."""
    good_share: float = 0.9
    """A good policy succeeds in more than this share of the oracle's episodes."""
    layer: str | None = None
    """Layer whose features are embedded; the last one before the logits by default."""
    grad_cam_layer: str | None = None
    """Layer that Grad-CAM looks at; the last convolution's nonlinearity by default."""
    perplexity: float = 30.0
    """Of t-SNE."""
    seed: int = 0
    """Of everything that is drawn."""

    def __post_init__(self) -> None:
        """Refuses what shows nothing."""
        if self.data_episodes < MIN_EPISODES:
            raise InputError(
                f"data_episodes={self.data_episodes} shows too little; give {MIN_EPISODES} or more"
            )
        if self.frames < self.data_episodes:
            raise InputError(
                f"frames={self.frames} is less than one of each flight; give "
                f"{self.data_episodes} (data_episodes) or more"
            )
        if self.episodes < 1:
            raise InputError(f"episodes={self.episodes} is out of range; give 1 or more")
        tsne.check_perplexity(self.perplexity, self.frames)
