"""`drone-rl reproduce`: the figures of Luo et al. (2018), each by one call."""

import dataclasses
import io
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import torch
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image, ImageOps
from scipy.spatial.distance import cdist

from drone_rl.config.configuration import from_arguments
from drone_rl.config.values import Seed
from drone_rl.envs.three_state import SUCCESS_PROBABILITY, exact_gradient
from drone_rl.explanations.class_model_gallery import CHAPTER, class_models
from drone_rl.explanations.embedding import embed
from drone_rl.explanations.heat_maps import Explainer
from drone_rl.explanations.hooks import feature_layer
from drone_rl.explanations.report.embedding import thumbnail_map
from drone_rl.explanations.rollouts import RolloutDataset, collect, render_frames, select_frames
from drone_rl.explanations.scenes import Scenes
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.training.three_state import sample_gradients, train_three_state
from drone_rl.trust.plots import images
from drone_rl.trust.plots.saving import to_png
from drone_rl.utils.display import Result, picture
from drone_rl.utils.errors import InputError
from drone_rl.utils.palette import INK, MUTED, css
from drone_rl.utils.progress import silent
from drone_rl.utils.provenance import provenance
from drone_rl.utils.schema import Whole
from drone_rl.utils.seeding import legacy_seed
from drone_rl.utils.settings import Settings

STEP_LENGTH = 0.25
"""Metres per action: episodes then have about as many frames as those of the chapter."""
_COUNTS = {(7, "poor"): (400, 15), (7, "right_and_forward"): (400, 8), (8, "good"): (625, 7)}
"""Frames and episodes that the chapter states for figures of t-SNE."""
_PERPLEXITY = 30.0
"""Of t-SNE, unless there are too few frames."""


class FigureSettings(Settings):
    """Settings of `drone_rl.reproduce`."""

    figure: Annotated[int, Whole(1, unit="the number of a figure")] = 8
    """Figure of the chapter: 3, or 7 to 15."""
    frames: Annotated[int, Whole(1, unit="frames")] | None = None
    """Frames of t-SNE (Figs. 7 and 8) or of the search for a pair (Fig. 9); null for the chapter's
    number."""
    episodes: Annotated[int, Whole(1, 1000, "episodes")] | None = None
    """Episodes from which the frames of Figs. 7 to 9 and 13 to 15 come; null for the chapter's
    number, in Figs. 13 to 15 for 20."""
    tint: Literal["predicted", "sampled"] = "predicted"
    """Action whose color tints a frame of Figs. 7 and 8: the most probable one, or the one that
    was sampled."""
    kernel: Literal["student", "gaussian"] = "student"
    """Similarity of points on the maps of Figs. 7 and 8: Student's t, as t-SNE is defined, or the
    Gaussian that Eq. 17 prints."""
    seed: Seed = 0
    """Root of all random streams."""


@dataclasses.dataclass(frozen=True)
class ChapterFigure(Result):
    """A figure of the chapter, made again."""

    settings: FigureSettings
    image: Image.Image
    caption: str
    """What the image shows, and how it was made."""
    numbers: Mapping[str, Any]
    """Plain values behind the image."""

    def save(self, folder: Path) -> None:
        """Write `figure_N.png` and `figure_N.json`."""
        name = f"figure_{self.settings.figure}"
        self.image.save(folder / f"{name}.png")
        header = {"caption": self.caption, "settings": self.settings.values()}
        written = {**header, **self.numbers, **provenance()}
        (folder / f"{name}.json").write_text(json.dumps(written, indent=2))

    def __str__(self) -> str:
        return f"Figure {self.settings.figure}: {self.caption}"

    def _repr_html_(self) -> str:
        return picture(self.image)


def reproduce(
    figure: int,
    settings: FigureSettings | None = None,
    *,
    outputs: str | Path = "outputs",
    **changes: Any,
) -> ChapterFigure:
    """Make a figure of the chapter again, with shipped policies and the chapter's set-up.

    Figs. 1, 2 and 4 to 6 are drawings and screenshots; see docs/chapter.md.

    Args:
        figure: Its number: 3, or 7 to 15.
        settings: Numbers of frames and episodes, tint and seed.
        outputs: See `load_policy`.
        changes: Changes to the settings, as in `reproduce(8, tint="sampled")`.

    Raises:
        InputError: There is no such figure, the episodes have fewer frames than asked for, or in
            Fig. 9 the policy moves to one side only.
    """
    settings = from_arguments(FigureSettings, settings, {"figure": figure, **changes}, reproduce)
    if figure not in _FIGURES:
        numbers = ", ".join(map(str, _FIGURES))
        raise InputError(f"figure={figure} can't be reproduced; give one of {numbers}")
    make, names = _FIGURES[figure]
    image, caption, numbers = make(settings, *(load_policy(n, outputs=outputs) for n in names))
    return ChapterFigure(settings, image, caption, numbers)


_Drawn = tuple[Image.Image, str, dict[str, Any]]


def _three_states(settings: FigureSettings) -> _Drawn:
    """Fig. 3: REINFORCE on the process, and its gradient next to the exact one."""
    seeds = [(settings.seed + i) % 2**64 for i in range(5)]  # torch's generators take 64 bits
    runs = torch.stack([train_three_state(60, seed=seed).leaving for seed in seeds])
    estimates = sample_gradients(300, seed=seeds[0])
    exact, estimated = float(exact_gradient([0.5] * 3).sum()), float(estimates.mean())
    spread = 1.96 * float(estimates.std()) / len(estimates) ** 0.5
    figure = Figure(figsize=(9, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(runs.T.numpy(), color=css(MUTED), linewidth=0.9)
    left.plot(runs.mean(0).numpy(), color=css(INK), label="mean of 5 seeds")
    left.axhline(1.0, color=css(MUTED), linestyle="--", label="optimal policy")
    left.set(xlabel="updates of 8 episodes", ylabel="probability of a1 in s0", ylim=(0, 1.04))
    left.legend(loc="lower right", frameon=False)
    right.hist(estimates.numpy(), bins=25, color=css(MUTED), label="estimates (Eq. 12)")
    right.axvline(exact, color=css(INK), label=f"exact gradient: {exact:.4f}")
    label = f"mean estimate: {estimated:.4f} ± {spread:.4f}"
    right.axvline(estimated, color=css(INK), linestyle=":", label=label)
    right.set(xlabel="gradient by the logit of a1, uniform policy", ylabel="batches")
    right.legend(frameon=False, fontsize=8)
    caption = (
        "REINFORCE on the three-state process; action a1 leads from s0 to s2 and reward 1 with "
        f"probability {SUCCESS_PROBABILITY:g}, otherwise to s1."
    )
    numbers = {
        "exact_gradient": exact,
        "estimated_gradient": estimated,
        "half_width95": spread,
        "final_probability": float(runs.mean(0)[-1]),
    }
    return Image.open(io.BytesIO(to_png(figure))), caption, numbers


def _embeddings(settings: FigureSettings, *policies: Policy) -> _Drawn:
    """Figs. 7 and 8: t-SNE of the last layer's features, frames tinted by action."""
    maps, numbers = [], {}
    for policy in policies:
        data, network, scenes = _record(policy, settings, *_COUNTS[settings.figure, policy.name])
        layer, actions = feature_layer(network), scenes.actions
        assert layer is not None
        points, faithful = embed(
            data.arrays[f"features/{layer}"],
            perplexity=min(_PERPLEXITY, (len(data) - 1) // 3),
            seed=legacy_seed(settings.seed),
            kernel=settings.kernel,
        )
        taken = data.probabilities.argmax(1) if settings.tint == "predicted" else data.actions
        image = thumbnail_map(data.frames, points, [actions.colors[action] for action in taken])
        count = len(np.unique(data.episode))
        title = f"{policy.name}: {len(data)} frames of {count} episodes"
        maps.append(images.titled(image, title))
        numbers[policy.name] = {
            "frames": len(data),
            "episodes": count,
            "layer": layer,
            **faithful.model_dump(),
            "frames_by_action": {n: int((taken == a).sum()) for a, n in enumerate(actions.names)},
        }
    names = "forward violet, left orange, right blue"
    method = "SNE (Eq. 17 as printed)" if settings.kernel == "gaussian" else "t-SNE"
    caption = f"{method} of the policy's features, tinted by the {settings.tint} action: {names}."
    size = max(one.width for one in maps), max(one.height for one in maps)
    canvases = [ImageOps.pad(one, size, color="white", centering=(0, 0)) for one in maps]
    return images.gridded(canvases, len(maps)), caption, numbers


def _pair(settings: FigureSettings, policy: Policy) -> _Drawn:
    """Fig. 9: two similar frames with opposite actions."""
    data, _, scenes = _record(policy, settings, 625, 7)
    predicted, actions = data.probabilities.argmax(1), scenes.actions
    left, right = (np.flatnonzero(predicted == side) for side in (actions.left, actions.right))
    if not (len(left) and len(right)):
        raise InputError(
            f"policy {policy.name} moves to one side only in {len(data)} frames; give another "
            "seed, or more frames and episodes"
        )
    flat = data.observations.reshape(len(data), -1)
    distance = cdist(flat[left], flat[right]) / np.sqrt(flat.shape[1])
    row, column = np.unravel_index(distance.argmin(), distance.shape)
    pair = [int(left[row]), int(right[column])]
    tiles = [images.frame_with_probabilities(data.arrays, one, f"frame {one}") for one in pair]
    metres = float(np.abs(np.diff(data.offset(scenes.worlds)[pair], axis=0)).max())
    has_both = not np.isnan(metres)
    where = f"the next cube is {metres:.1f} m from its place in the other one"
    caption = (
        f"The two most similar frames on which policy {policy.name} most probably moves to "
        f"opposite sides; {where if has_both else 'one of them has no next cube'}."
    )
    numbers = {
        "frames": pair,
        "distance": float(distance.min()),
        "metres_apart": metres if has_both else None,
    }
    return images.gridded(tiles, 2), caption, numbers


def _class_models(settings: FigureSettings, policy: Policy) -> _Drawn:
    """Figs. 10 to 12: class models with the chapter's refinements."""
    models = class_models(policy, seed=settings.seed, progress=silent, **CHAPTER)
    caption = (
        f"Class models of policy {policy.name}: gradient ascent on the action's probability "
        "(Eq. 18) in steps of fixed length, with blur and the training set's mean and deviation."
    )
    header, values = models.rows()
    probabilities = dict(zip(header[1:], map(float, values[1:]), strict=True))
    return models.figure(), caption, {"probabilities": probabilities}


def _attributions(settings: FigureSettings, policy: Policy) -> _Drawn:
    """Figs. 13 to 15: Grad-CAM of the sampled action in six frames."""
    data, network, scenes = _record(policy, settings, None, 20)
    task: Any = scenes.task
    rows = _spread_by_side(data.offset(scenes.worlds)[:, 1], task.settings.touch_distance)
    explainer = Explainer(network, scenes.absent)
    heat = explainer.grad_cam(data.tensor("observations")[rows], data.tensor("actions")[rows])
    tiles = []
    for letter, row, one in zip("abcdef", rows, scenes.to_frame(heat).numpy(), strict=False):
        hot = images.titled(images.enlarge(images.heated(data.frames[row], one)), f"({letter})")
        bars = images.indicator(data.probabilities[row].tolist(), int(data.actions[row]), hot.width)
        tiles.append(images.stacked([hot, bars]))
    caption = (
        f"Grad-CAM (Eqs. 19 and 20) of policy {policy.name} for the sampled action, whose bar is "
        "dark; the next cube is to the left, ahead or to the right."
    )
    return images.gridded(tiles, 3), caption, {"frames": rows.tolist()}


_FIGURES: Mapping[int, tuple[Callable[..., _Drawn], tuple[str, ...]]] = {
    3: (_three_states, ()),
    7: (_embeddings, ("poor", "right_and_forward")),
    8: (_embeddings, ("good",)),
    9: (_pair, ("good",)),
    10: (_class_models, ("good",)),
    11: (_class_models, ("uniform",)),
    12: (_class_models, ("right_and_forward",)),
    13: (_attributions, ("good",)),
    14: (_attributions, ("uniform",)),
    15: (_attributions, ("right_and_forward",)),
}
"""The function that makes each figure, and its shipped policies."""


def _record(
    subject: Policy, settings: FigureSettings, frames: int | None, episodes: int
) -> tuple[RolloutDataset, Any, Scenes]:
    """Return frames of episodes with sampled actions, the network and the scenes.

    The settings' numbers of frames and episodes precede the arguments. If `frames` is None, all
    frames are returned.
    """
    episodes = settings.episodes or episodes
    network = subject.make_network()
    layer = feature_layer(network)
    with subject.in_task(step_length=STEP_LENGTH).flying(episodes, seed=settings.seed) as made:
        env, actor = made
        flights, scenes = collect(env, actor, num_episodes=episodes), Scenes(env)
        count = len(flights) if frames is None else settings.frames or frames
        if count > len(flights):
            raise InputError(
                f"frames={count} is more than the {len(flights)} of {episodes} episodes of policy "
                f"{subject.name}; give fewer frames or more episodes"
            )
        rows = select_frames(flights.episode, count)
        layers = (layer,) if layer else ()
        return render_frames(flights, rows, scenes, network, layers), network, scenes


def _spread_by_side(aside: NDArray, touch_distance: float) -> NDArray:
    """Return two frames each with the next cube to the left, ahead and to the right."""
    sides = (aside > touch_distance, np.abs(aside) <= touch_distance, aside < -touch_distance)
    rows = [np.flatnonzero(side) for side in sides if side.any()]
    return np.concatenate([r[np.linspace(0, len(r) - 1, 4)[1:-1].astype(int)] for r in rows])
