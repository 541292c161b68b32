"""`drone-rl class-models`: class model visualization with settings of one's own (section 5.2)."""

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from drone_rl.config.configuration import from_arguments
from drone_rl.explanations.class_models import NO_GRADIENTS, best_models, image_statistics
from drone_rl.explanations.hooks import of_input, rest_in
from drone_rl.explanations.results import BestModels, ImageStatistics
from drone_rl.explanations.rollouts import collect
from drone_rl.explanations.scenes import Scenes
from drone_rl.explanations.settings import (
    ClassModelSettings,
    ClassModelsSettings,
)
from drone_rl.policies.external_network import Logits
from drone_rl.policies.external_policy import as_policy
from drone_rl.policies.policy import BasePolicy
from drone_rl.sim.vocabulary import ShownActions
from drone_rl.trust.plots import images
from drone_rl.utils.display import TableResult
from drone_rl.utils.errors import InputError
from drone_rl.utils.models import Seeded
from drone_rl.utils.progress import Progress, as_progress
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seeding import RootSeed, with_seed
from drone_rl.utils.text import listed

_PRINTED: Mapping[str, Any] = {
    "maximize": "probability", "step": "plain", "lr": 1.0, "normalize": "none",
    "blur": 0.0, "clamp": False, "jitter": 0, "starts": 1,
}  # fmt: skip
_LONG_STEPS = {**_PRINTED, "lr": 20.0, "step": "length"}
CHAPTER: Mapping[str, Any] = {**_LONG_STEPS, "normalize": "match", "blur": 0.6}
"""Gradient ascent on Eq. 18 with the refinements that the chapter names, as far as they help.

Steps have a fixed length because the gradient of a probability near 0 vanishes. Images keep the
training set's mean and deviation: to subtract and divide at each step, as the chapter says, lets
them grow without bound where the deviation is below 1.
"""
_CLIPPED = {**CHAPTER, "clamp": True}
GALLERY: Mapping[str, Mapping[str, Any]] = {
    "Eq. 18, learning rate 1": _PRINTED,
    "learning rate 20": {**_PRINTED, "lr": 20.0},
    "+ fixed length": _LONG_STEPS,
    "+ mean, deviation divided": {**_LONG_STEPS, "normalize": "training_set"},
    "mean, deviation kept": {**CHAPTER, "blur": 0.0},
    "+ blur": CHAPTER,
    "+ clipping": _CLIPPED,
    "logit": {**_CLIPPED, "maximize": "logit"},
    "+ squared penalty": {**_CLIPPED, "maximize": "logit", "l2": 1e-3},
    "defaults": {},
}
"""The chapter's refinements one after the other, then further ones and the defaults."""
_BATCH = 64
"""Environments that collect the training set."""


@dataclasses.dataclass(frozen=True)
class ClassModels(TableResult):
    """Observations optimized for each action of a policy, with one or several settings."""

    policy: BasePolicy
    tried: Mapping[str, tuple[ClassModelSettings, BestModels]]
    """Settings and their results, by title."""
    statistics: ImageStatistics
    """Of the observations in the policy's episodes, the training set."""
    actions: ShownActions
    channels: str
    """What the channels of an observation are, see `images.shown_picture`."""
    seed: RootSeed

    def rows(self) -> list[list[str]]:
        """Return a table of texts: a header, then each setting's probability of each action."""
        order, names = self.actions.order, self.actions.names
        rows = [["settings", *(names[action] for action in order)]]
        for title, (_, best) in self.tried.items():
            rows.append([title, *(f"{best.probabilities[action]:.3f}" for action in order)])
        return rows

    def figure(self) -> Image.Image:
        """Return the images: a row for each setting, a column for each action.

        Black and white are the limits of the observations; without clipping, those of the row.
        """
        tiles, order = [], self.actions.order
        for title, (settings, best) in self.tried.items():
            low, high = self.statistics.low, self.statistics.high
            if not settings.clamp:
                low, high = float(best.images.min()), float(best.images.max())
            for action in order:
                start = f"{title}: " if len(self.tried) > 1 and action == order[0] else ""
                caption = f"{start}{self.actions.names[action]} {best.probabilities[action]:.3f}"
                image = images.shown_picture(best.images[action], low, high, self.channels)
                tiles.append(images.titled(images.enlarge(image), caption))
        return images.gridded(tiles, len(order))

    def save(self, folder: Path) -> None:
        """Write `class_models.png`, `class_models.json` and `class_models.npz`."""
        self.figure().save(folder / "class_models.png")
        written = {
            "policy": self.policy.source,
            **self.seed.as_dict(),
            "statistics": self.statistics.model_dump(),
            "settings": {
                title: {**settings.values(), **best.model_dump(exclude={"images"})}
                for title, (settings, best) in self.tried.items()
            },
            **provenance(),
        }
        (folder / "class_models.json").write_text(json.dumps(written, indent=2))
        pixels: dict[str, Any] = {
            f"images_{i}": of.images for i, (_, of) in enumerate(self.tried.values())
        }
        np.savez_compressed(folder / "class_models.npz", **pixels)

    def notes(self) -> list[str]:
        """Return a line for each setting that makes some action improbable, and the seed's."""
        lines = []
        for title, (_, best) in self.tried.items():
            order, reached = self.actions.order, best.probabilities
            if failed := [self.actions.names[a] for a in order if reached[a] <= 0.5]:
                lines.append(
                    f"{title}: no image found makes {listed(failed, 'or')} more probable than not; "
                    "the policy or these settings may be the reason, compare gallery=true"
                )
        return [*lines, Seeded(**self.seed.as_dict()).seed_line()]


def class_models(
    policy: str | Path | BasePolicy | Logits,
    settings: ClassModelsSettings | None = None,
    *,
    task: Mapping[str, Any] | None = None,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    **changes: Any,
) -> ClassModels:
    """Optimize an observation for each action of a policy (section 5.2, Eq. 18).

    `drone_rl.explain` tries several settings and keeps the best; this function uses those given.

    Args:
        policy: The policy, what `load_policy` takes, or a callable, see `policy_from`.
        settings: Of the gradient ascent; `gallery` replaces them by each refinement.
        task: Changes to the policy's task.
        outputs: See `load_policy`.
        progress: Called with the progress; a bar by default.
        changes: Changes to the settings, as in `class_models("good", maximize="probability")`.

    Raises:
        InputError: The policy or a setting is unusable, or the images diverge.
    """
    settings, seed = with_seed(from_arguments(ClassModelsSettings, settings, changes, class_models))
    progress = as_progress(progress)
    subject = as_policy(policy, outputs, task=task)
    network = subject.make_network()
    if not network.is_differentiable:
        raise InputError(NO_GRADIENTS)
    tried = {"given settings": settings.as_base(ClassModelSettings)}
    if settings.gallery:
        tried = {title: ClassModelSettings(**changed) for title, changed in GALLERY.items()}
    steps = len(tried) + 1
    progress(f"{settings.episodes} episodes", 0, steps)
    with subject.flying(min(settings.episodes, _BATCH), seed=seed.value) as (env, actor):
        scenes = Scenes(env, settings.image)
        if scenes.image is None:
            raise InputError(f"class models are images, and {scenes.name} is none; see image")
        network = of_input(network, scenes.name)
        data = collect(env, actor, num_episodes=settings.episodes, observations=scenes.name)
    statistics = image_statistics(data.tensor("observations"))
    found = {}
    for number, (title, one) in enumerate(tried.items(), start=1):
        progress(title, number, steps)
        found[title] = (
            one,
            best_models(network, statistics, [one], seed=seed.value, rest=rest_in(data.others)),
        )
    progress("optimized", steps, steps)
    return ClassModels(subject, found, statistics, network.actions.shown, scenes.channels, seed)
