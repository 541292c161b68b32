"""Results of the sections of an explanation, and the files that hold them.

`explanation.json` has the numbers, `arrays.npz` the fields that are arrays, each under its dotted
name, such as "truth.patch_effects". This module imports no torch, so that a report can be built
without.
"""

from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from pydantic import ConfigDict, Field
from pydantic_core import to_json

from drone_rl.sim.vocabulary import ShownActions, TaskVocabulary
from drone_rl.trust.findings import Finding, untested
from drone_rl.trust.results import Verdict
from drone_rl.trust.shifts_results import Robustness, SavedShifts, find
from drone_rl.utils.archives import read_arrays
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import parse_json, read_bytes
from drone_rl.utils.intervals import Mean, Share, episode_means, median_bounds
from drone_rl.utils.limits import EXPLANATION_BYTES
from drone_rl.utils.models import Model, Seeded
from drone_rl.utils.text import render

Array = np.ndarray
"""An array of a result; the fields say its shape."""


class Dataset(Model):
    """Statistics of the recorded rollouts."""

    frames: int
    """Frames that are analysed."""
    episodes: int
    steps: int
    action_shares: tuple[float, ...]
    """Fraction of the steps with each action."""
    entropy: Mean
    """Of the policy, relative to the uniform one's."""
    goals_reached: int
    remembers: bool = False
    """Whether the policy remembers earlier frames."""


class Faithfulness(Model):
    """How well an embedding keeps neighbourhoods."""

    neighbours: int
    """Size of a neighbourhood."""
    trustworthiness: float
    """1 if all neighbours in the plane are neighbours originally (Venna and Kaski, 2001)."""
    neighbours_kept: float
    """Fraction of the nearest in the plane that are among the nearest originally."""
    neighbours_chance: float
    """The same for a random embedding."""


class Embedding(Faithfulness):
    """An embedding of frames in the plane."""

    layer: str | None
    """Layer of the features; None for pixels."""
    perplexity: float
    points: Array
    """Shape: (T, 2)."""


class Tsne(Model):
    """t-SNE of the analysed frames."""

    features: Embedding
    pixels: Embedding


class Pair(Model):
    """Two similar frames with opposite actions."""

    left: int
    """The frame with the higher probability of left."""
    right: int
    """The frame with the higher probability of right."""
    distance: float
    """Root mean square difference of the observations."""
    opposition: float
    """From 0 to 1; see `Actions.opposition`."""
    kind: Literal["contradiction", "justified", "unknown"]
    """Whether the next target is at about the same place in both, elsewhere, or one has none.

    Also unknown if the policy remembers earlier frames, which may justify the difference.
    """


class Loop(Model):
    """A part of an episode in which the drone moves back and forth."""

    first: int
    """Its first step."""
    length: int
    reversals: int


class Flaws(Model):
    """Contradictions among the analysed frames (Fig. 9), and loops in whole episodes."""

    pairs: tuple[Pair, ...]
    """Most opposed first."""
    alike_metres: float
    """Largest distance along an axis of targets that are at the same place."""
    loops: tuple[Loop, ...]
    looping_steps: float
    """Fraction of the steps that belong to a loop."""
    looping_episodes: Share
    """Episodes with a loop."""


class ImageStatistics(Model):
    """Statistics of the data set's observations, which optimized ones keep."""

    mean: float
    std: float
    low: float
    high: float
    roughness: float


class BestModels(Model):
    """The best class models by one objective."""

    probabilities: tuple[float, ...]
    """Of each action on its image."""
    attempts: int
    """Images that were optimized for an action."""
    highest: tuple[float, ...]
    """The highest probability of all attempts, by action."""
    images: Array
    """Shape: (num_actions, C, h, w)."""


class ClassModel(Model):
    """Observations optimized for each action (section 5.2)."""

    statistics: ImageStatistics
    channels: str
    """See `Scenes.channels`."""
    probability: BestModels
    logit: BestModels


class KeyStep(Model):
    """A step of the film that is shown as an image."""

    step: int
    why: str


class Attribution(Model):
    """Heat maps of one episode, of n steps."""

    layer: str | None
    """Layer of Grad-CAM."""
    shown: str
    """The method that is shown if none passed the tests."""
    heat_by: tuple[str | None, ...]
    """The method whose map is shown at each step; None without any heat."""
    key_steps: tuple[KeyStep, ...]
    frames: Array
    """Shape: (n, H, W, 3)."""
    heat: dict[str, Array]
    """Maps of each method, the maximum of each 1. Shape: (n, H, W)."""
    probabilities: Array
    """Shape: (n, num_actions)."""
    actions: Array
    """Shape: (n,)."""


class Median(Model):
    """A median over episodes with bounds, None of too few episodes."""

    median: float
    lower: float | None
    upper: float | None

    @classmethod
    def of(cls, values: Array, episode: Array, level: float, **more: Any) -> Self:
        """Return the median of the episodes' means; each bound holds with probability 1 - level.

        Shapes: (T,), the values of frames and their episodes.
        """
        means = episode_means(values, episode)
        lower, upper = median_bounds(means, 1.0 - 2 * level) or (None, None)
        return cls(median=float(np.median(means)), lower=lower, upper=upper, **more)


class InputEffect(Model):
    """How far the action probabilities depend on one input; bounds hold with 1 - level each."""

    effect: Median
    """Their distance if the input is that of another episode."""
    placebo: Median
    """Their distance if it is measured twice in the same states."""
    excess: Median
    """Effect minus placebo."""
    matters: bool
    """Whether the lower bound of the excess is more than `Importance.least`."""


class Importance(Model):
    """Effects of replacing each input of a policy that has several."""

    inputs: dict[str, InputEffect]
    least: float
    """Excess up to which an input does not matter."""
    level: float
    """Error rate of each lower bound."""


class Pointing(Median):
    """How much more often than chance a map's hottest patch has one of the largest effects."""

    hit: float
    chance: float


class Likeness(Median):
    """Correlation of a policy's maps with those of shuffled weights."""

    seeds: tuple[float, ...]
    """Of each shuffled policy."""


class MethodTest(Model):
    """Results of one method; those of tests are missing without frames."""

    trusted: bool
    failed: tuple[str, ...]
    """Names of the failed tests."""
    score: Mean
    placebos: dict[str, Median] = Field({})
    """How much more it scores than each placebo."""
    pointing: Pointing | None = None
    likeness: Likeness | None = None

    @property
    def weakest(self) -> Median | None:
        """Return the comparison with the placebo that it beats least reliably."""
        bounds = self.placebos.values()
        return min(bounds, key=lambda b: -np.inf if b.lower is None else b.lower, default=None)


class MapTests(Model):
    """Tests of heat maps; see `drone_rl.explanations.trust`."""

    trusted: str | None
    """The best method that passed all tests."""
    methods: dict[str, MethodTest]
    placebos: dict[str, Mean]
    """Their scores."""
    frames: int
    frames_unmoved: int
    """Frames that are left out, since no part of them affects the policy."""
    episodes: int
    level: float
    """Error rate of each method."""
    confidence: float
    """Of the bounds of medians."""


class Outcomes(Model):
    """Greedy rollouts with the next target moved, and with another ground."""

    flights: int
    """Number of rollouts of each variant."""
    collected: dict[str, Mean]
    """Rollouts that reach the target: "as it was", "moved left", "moved right"."""
    follows: Mean
    """Metres that the drone moves sideways with the target per metre."""
    ground_changed: Mean | None
    """Rollouts whose outcome differs with another ground; None if no frame shows any, as in scene
    files, whose floors are geoms like others."""

    @property
    def finding(self) -> Finding | None:
        """The effect of another ground, which should have none."""
        if self.ground_changed is None:
            return None
        text = render("drone_rl.explanations.report", "ground.j2", outcomes=self)
        effect, tested = self.ground_changed.mean or 0.0, frozenset({"color"})
        return Finding(text=text, effect=effect, tested=tested, section="truth")


class Truth(MapTests):
    """Tests of the heat maps, and effects of changes to the scene."""

    interventions: dict[str, Mean]
    """Effect of each change on the action probabilities; none if nothing can be changed."""
    outcomes: Outcomes | None
    """None if no frame has a next target."""
    shown_frame: int
    changed: Array
    """That frame after each change. Shape: (K, H, W, 3)."""
    patch_effects: Array
    """Mean effect of each patch. Shape: (rows, columns)."""

    @property
    def best_placebo(self) -> str:
        """Return the placebo with the highest mean score."""
        return max(self.placebos, key=lambda name: self.placebos[name].mean or 0.0)


class TargetGrid(Model):
    """Places of one target: Z up, F ahead, L sideways."""

    height: Array
    """Metres above the drone. Shape: (Z,)."""
    forward: Array
    """Metres ahead of it. Shape: (F,)."""
    lateral: Array
    """Metres to its left. Shape: (L,)."""
    oracle: Array
    """The needed action: a turn where flying straight on would miss. Shape: (L,)."""
    stratum: Array
    """`Side` of a target there. Shape: (L,)."""


class ResponseMap(TargetGrid):
    """Action probabilities for one target at each place."""

    probabilities: Array
    """Shape: (Z, F, L, A)."""
    without_target: Array
    """Action probabilities without a target. Shape: (A,)."""
    blind: Array
    """See `find_blind`. Shape: (Z, F, L), bool."""


class OutcomeMap(TargetGrid):
    """Whether greedy rollouts reach a target at each place."""

    collected: Array
    """Shape: (Z, F, L), bool."""


class ResponseRow(Model):
    """Results for targets at one height and side."""

    height: float
    side: str
    blind: float | None
    """Fraction of the places at which the policy is blind; None if that is unknown."""
    collected: int
    """Places from which it reaches the target."""
    places: int


class Response(Model):
    """The policy's response to one target by its place."""

    rows: tuple[ResponseRow, ...]
    blind_below: float
    """Largest change of the probabilities that counts as none."""
    asymmetry: float
    """Mean distance of the map from its mirror image."""
    map: ResponseMap
    outcome: OutcomeMap


class Window(Model):
    """Positions of one cube relative to the camera, metres."""

    nearest: float
    farthest: float
    sideways: float


class ActionShares(Model):
    """Fractions of an area of positions."""

    share: float
    """The area, as a fraction of all positions."""
    actions: tuple[float, ...]
    """With each action."""
    unseen: float
    """Where no pixel shows the cube."""
    blind: float
    """Where a turn is needed, and the action is that without a cube."""


class Outlines(Model):
    """Closed polygons around regions of equal action."""

    points: Array
    """Corners of all polygons: metres ahead and to the left. Shape: (P, 2)."""
    ends: Array
    """End of each polygon among them. Shape: (N,)."""
    labels: Array
    """Action of each, or one more than the last action if the cube is not seen. Shape: (N,)."""


class ExactMap(ActionShares):
    """The policy's action over all positions of one cube: areas, not samples."""

    share: float = 1.0
    window: Window
    area: float
    """Of the window, m^2."""
    cells: int
    """Cells of positions with one image each."""
    sides: dict[str, ActionShares]
    alone: int
    """The action without a visible cube."""
    touch_distance: float
    """Metres; a cube further to the side requires a turn."""
    least_gap: float
    """Smallest difference of the two highest logits."""
    least_gap_ahead: float
    """Its position, metres."""
    least_gap_left: float
    logit_gap: float
    """A difference of logits up to which rounding may decide."""
    close: float
    """Fraction of the positions with a smaller difference."""
    in_doubt: float
    """Bound on the fraction of the positions where float32 may show a neighbour's image."""
    outlines: Outlines


class Mirrored(Model):
    """A frame, and how far the policy differs from its mirror image there."""

    frame: int
    distance: float


class Asymmetry(Model):
    """The policy compared with its mirror image on the analysed frames."""

    signed: Mean
    """Preference for left over right, in probability."""
    absolute: Mean
    """Distance of the probabilities."""
    worst: tuple[Mirrored, ...]


class SceneMap(Model):
    """Paths of episodes in scene files."""

    by_start: dict[str, Share]
    """Success rate of the most probable actions by the name of the start."""
    picture: Array
    """The floor plans with paths, RGB, uint8. Shape: (height, width, 3)."""


class Explanation(Seeded):
    """Everything that is known of one policy; a section that is not computed is None.

    Results of other sections are kept under their names. After reading, they are plain values.
    """

    model_config = ConfigDict(extra="allow")

    format: Literal["drone_rl explanation"] = "drone_rl explanation"
    format_version: Literal[4] = 4
    name: str
    """Name of the policy."""
    date: str
    settings: dict[str, Any]
    """See `ExplainSettings`."""
    seconds: dict[str, float]
    """Time of each section."""
    actions: ShownActions
    terms: TaskVocabulary
    """Vocabulary of the task."""
    provenance: dict[str, Any]
    left_out: dict[str, str] = Field({})
    """Why sections, or parts of them, are left out."""
    verdict: Verdict | None = None
    shifts: SavedShifts | None = None
    dataset: Dataset | None = None
    tsne: Tsne | None = None
    flaws: Flaws | None = None
    class_model: ClassModel | None = None
    attribution: Attribution | None = None
    importance: Importance | None = None
    truth: Truth | None = None
    response: Response | None = None
    places: ExactMap | None = None
    asymmetry: Asymmetry | None = None
    scene_map: SceneMap | None = None
    data: dict[str, Array] = Field({}, exclude=True)
    """Arrays of `dataset.npz`, with the analysed frames."""
    source: str = Field("explanation.json", exclude=True)
    """Display name of its file."""

    @property
    def trusted_method(self) -> str | None:
        """Return the heat maps that passed the tests best, if any did."""
        return self.truth.trusted if self.truth else None

    @property
    def robustness(self) -> Robustness | None:
        """Return the measured robustness, None if it is refused or contradicts the verdict."""
        saved, verdict = self.shifts, self.verdict
        return saved.shifts if saved and verdict and not saved.why_not(verdict) else None

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What the policy's success depends on, the largest effect first."""
        outcomes = self.truth.outcomes if self.truth else None
        others = [outcomes.finding] if outcomes and outcomes.finding else []
        return find(self.verdict, self.shifts, others) if self.verdict else tuple(others)

    @property
    def untested(self) -> list[str]:
        """Which of colors, light and sizes no finding tests."""
        return untested(self.findings)

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Read a folder of `drone-rl explain`.

        Raises:
            InputError: A file is missing, damaged, too large, or of another version.
        """
        name = "explanation.json"
        try:
            content: Any = parse_json(read_bytes(folder / name, EXPLANATION_BYTES), name)
            for path, array in read_arrays(folder / "arrays.npz").items():
                _insert(content, path.split("."), array)
            data = read_arrays(folder / "dataset.npz")
            return cls.read({**content, "data": data, "source": f"{folder.name}/{name}"})
        except (InputError, OSError, LookupError, TypeError) as error:
            raise InputError(
                f"explanation {folder} can't be read ({error}); run drone-rl explain again"
            ) from None

    def save(self, folder: Path) -> None:
        """Write `explanation.json` and `arrays.npz` to an existing folder."""
        numbers, arrays = self.model_dump(serialize_as_any=True), dict[str, Any]()
        _remove(numbers, "", arrays)
        np.savez_compressed(folder / "arrays.npz", **arrays)
        (folder / "explanation.json").write_bytes(to_json(numbers, indent=1))


def _remove(tree: dict[str, Any], start: str, arrays: dict[str, Any]) -> None:
    """Move the arrays of a tree to a dictionary with dotted names."""
    for name, value in [*tree.items()]:
        if isinstance(value, dict):
            _remove(value, f"{start}{name}.", arrays)
        elif isinstance(value, np.ndarray):
            arrays[start + name] = tree.pop(name)


def _insert(tree: Any, path: list[str], array: Array) -> None:
    """Put an array where `_remove` took it."""
    for name in path[:-1]:
        tree = tree[name]
    tree[path[-1]] = array
