"""Results of judging a policy: figures of episodes, failures, and the verdict."""

from typing import Any

import pydantic

from drone_rl.config.task import DEFAULT_TASK
from drone_rl.sim.vocabulary import TaskVocabulary, shipped_vocabulary
from drone_rl.trust.findings import Finding
from drone_rl.trust.rule import USABLE, Quantity, VerdictKind
from drone_rl.utils.intervals import Mean, Share
from drone_rl.utils.models import Seeded, Stored
from drone_rl.utils.text import render

FREQUENT = 0.02
"""Fraction of episodes above which the text mentions an end."""
NEEDED_EPISODES = 50
"""Episodes that have to be repeated for a certain verdict."""
MAX_DIFFERENT = 1
"""Repeated episodes that may end otherwise."""
SUCCEEDS, SAME = 0.3, 0.1
"""A policy that succeeds in at least the first fraction of episodes does not use its camera if this
changes by less than the second one with the images of other episodes."""


class GoalShare(Mean):
    """Mean fraction of goals reached."""

    goals: int | None = None
    """Number of these goals."""


class Figures(Stored):
    """Figures of an evaluation, with 95% intervals over episodes."""

    episodes: int
    success: Share
    """Success rate."""
    shares: dict[str, GoalShare]
    """Mean fractions of goals reached: of "all", and by stratum over the episodes that offered such
    a goal (None if there are none). Goals that never came up count as missed among all."""
    never_reached: Mean | None = None
    """Fraction of goals that never came up."""
    ends: dict[str, Share] = {}
    """Fractions of episodes by the name of the end."""
    mean_goals: float | None = None
    """Goals reached in an episode."""
    mean_length: float | None = None
    """Steps of an episode."""
    max_length: int | None = None

    @property
    def strata(self) -> dict[str, GoalShare]:
        """`shares` by stratum, from left to right."""
        return {name: share for name, share in self.shares.items() if name != "all"}


class Failure(Stored):
    """First failures of a class of goals or at an end."""

    by: str
    """Variable that classifies the goals, or "end"."""
    value: str
    episodes: int
    """Episodes that offered such a goal at or before their first failure."""
    failed: int
    """Those whose first failure it was."""
    share: float | None
    """None without such episodes."""
    lower95: float
    upper95: float
    """The intervals of all rows hold at once."""


class Failures(Stored):
    """First failures by class of goal and by how the episode ended."""

    rows: tuple[Failure, ...]
    largest: Failure | None
    """The row with the greatest product of failures and lower bound, None if nothing failed; the
    end to which every missed goal leads only if no other row has failures."""
    expected_end: str | None = None
    """That end, None if the task has none."""
    bound: Share
    """The fraction of episodes that failed."""

    @property
    def other_ends(self) -> list[Failure]:
        """Ends by which many episodes fail, except the expected one and the largest row."""
        ends = (row for row in self.rows if row.by == "end" and row.lower95 > FREQUENT)
        return [row for row in ends if row.value != self.expected_end and row != self.largest]


class Repeated(Stored):
    """Episodes that were run again in one way."""

    how: str
    """How the policy was called, such as "one environment at a time"."""
    different: int
    """Episodes that ended otherwise, or in which other goals were reached."""
    successes: int


class Repetition(Stored):
    """The same episodes, run again with the policy called in other ways."""

    implementation: str
    """What ran them first, such as "fused kernel"; PyTorch ran them again."""
    episodes: int
    successes: int
    """Of the first run."""
    runs: tuple[Repeated, ...]

    @property
    def worst(self) -> Repeated:
        """The run with most differences."""
        return max(self.runs, key=lambda run: run.different)

    @pydantic.computed_field
    @property
    def is_same(self) -> bool:
        """Whether no run differs in more than `MAX_DIFFERENT` episodes."""
        return self.worst.different <= MAX_DIFFERENT


class CameraUse(Stored):
    """What changes if a policy gets the images of other episodes."""

    own: float
    """Success rate with its own images."""
    exchanged: float | None
    """Success rate with the images of other episodes, from the same initial states; None if no
    episode got such images, since there was one environment at a time."""
    success: Mean
    """Difference of the success rates, paired."""
    strata: dict[str, Mean]
    """By stratum, difference of the fractions of goals reached; all intervals hold at once."""
    needs_images: bool = True
    """Whether no blind baseline is as good as a good policy has to be. If one is, success with
    other images does not show that the policy ignores its own."""

    @pydantic.computed_field
    @property
    def is_used(self) -> bool | None:
        """Whether the policy uses its camera; None if that is not determined.

        Of a policy that hardly ever succeeds, only the goals that it reaches can show it.
        """
        if self.own >= SUCCEEDS:
            if max(-self.success.lower95, self.success.upper95) <= SAME:
                return False if self.needs_images else None
            return _is_outside(self.success) or None
        return any(map(_is_outside, self.strata.values())) or None


class InputUse(Stored):
    """What changes if a policy gets one of its inputs from other episodes."""

    changed: Share
    """Steps in which this changes the most probable action, of the policy's own episodes."""
    own: float
    """Success rate with its own input."""
    exchanged: float
    """Success rate with that of other episodes, from the same initial states."""
    success: Mean
    """Difference of the success rates, paired."""

    @pydantic.computed_field
    @property
    def is_ignored(self) -> bool:
        """Whether no action changes."""
        return self.changed.trials > 0 and not self.changed.successes

    @pydantic.computed_field
    @property
    def is_dispensable(self) -> bool:
        """Whether a policy that does its task succeeds as often with that of other episodes."""
        within = max(-self.success.lower95, self.success.upper95) <= SAME
        return self.own >= SUCCEEDS and within


def _is_outside(difference: Mean) -> bool:
    return difference.lower95 > SAME or difference.upper95 < -SAME


class Proof(Seeded):
    """What a certificate of the policy states and how it was checked, or why it is refused.

    The seed is that of the placements of the episodes that checked it.
    """

    path: str = ""
    """The file."""
    refused: str | None = None
    """The reason; None if it is quoted."""
    every: bool = False
    """Whether it states success from every placement."""
    share: float = 0.0
    """Fraction of placements from which all cubes are collected."""
    undecided: float = 0.0
    checked: int = 0
    """Episodes that checked it, all of which ended as it states."""
    wrong_at_most: float | None = None
    """Upper bound on the fraction of placements with a wrong statement, with 95% confidence; None
    without episodes."""
    computed: bool = False
    """Whether the proof of success from every placement was computed again by this program."""

    @property
    def status(self) -> str:
        """What the certificate states, and how far it is to be believed, as text."""
        return render("drone_rl.trust", "certificate.j2", p=self)


class Difference(Stored):
    """A setting that differs from the policy's training."""

    own: Any
    """Its value in training."""
    flown: Any


class Verdict(Seeded):
    """The kind of a policy, whether that is certain, and why; as in `verdict.json`."""

    kind: VerdictKind
    certain: bool
    exit_code: int
    """Exit code of the kind if it is certain, else `exit_codes.NOT_CERTAIN`."""
    rule: str = ""
    """The rule as text."""
    error_rate: float
    """Largest fraction of cases in which the rule gives a certain and wrong verdict."""
    good_share: float
    """See `Rule.good_share`."""
    terms: TaskVocabulary = shipped_vocabulary(DEFAULT_TASK)
    num_cubes: int = 0
    """Goals of an episode."""
    repetition: Repetition | None = None
    """None for baselines, which see no images."""
    camera: CameraUse | None = None
    """Likewise."""
    inputs: dict[str, InputUse] = {}
    """By name, of a policy with several inputs."""
    proof: Proof | None = None
    """None if the policy has no certificate."""
    greedy: Figures
    """Of episodes with the most probable actions."""
    sampled: Figures | None = None
    """Of episodes with sampled actions."""
    baselines: dict[str, Figures]
    """Of the task's random and constant baselines, and of the oracle if there is one."""
    drawing: Mean | None = None
    """Difference of the success rates of sampled and most probable actions, paired."""
    failures: Failures
    quantities: dict[str, Quantity] = {}
    """The rule's quantities."""
    enough: int | None = None
    """About how many episodes certainty needs; None if that is not known."""
    unlike: dict[str, Difference] = {}
    """Settings that differ from the training, by name."""
    known_scenes: tuple[str, ...] = ()
    """The scene files of the training, if the verdict has no other ones."""

    @pydantic.computed_field
    @property
    def sentence(self) -> str:
        """The verdict as text."""
        return render("drone_rl.trust", "verdict.j2", v=self)

    @property
    def is_decided(self) -> bool:
        """Whether the episodes are enough for the rule; repetition and camera are further tests."""
        return self.enough is not None and self.enough <= self.greedy.episodes

    @property
    def own_findings(self) -> list[Finding]:
        """What the episodes of the verdict show."""
        success, drawing = self.greedy.success.share, self.drawing
        effects = {
            "failures.j2": 0.0 if success is None else 1.0 - success,
            "sampled.j2": abs(drawing.mean or 0.0) if drawing else 0.0,
        }
        texts = {name: render("drone_rl.trust", name, v=self) for name in effects}
        return [Finding(text=texts[name], effect=effects[name]) for name in effects if texts[name]]

    @property
    def quoted(self) -> Proof | None:
        """The certificate if it is not refused."""
        return None if self.proof is None or self.proof.refused else self.proof

    @property
    def is_proved(self) -> bool:
        """Whether success from every placement was proved here, not only read from a file."""
        return self.quoted is not None and self.quoted.computed

    @property
    def failing_side(self) -> str | None:
        """Stratum in which a one-sided policy fails."""
        strata = [*self.greedy.strata] or [""]
        first, last = strata[0], strata[-1]
        ends = {VerdictKind.ONE_SIDED_LEFT: last, VerdictKind.ONE_SIDED_RIGHT: first}
        return ends.get(self.kind)

    @property
    def best_baseline(self) -> str:
        """Random or constant baseline that reaches most goals."""
        return max(self._blind, key=lambda name: self._blind[name].shares["all"].mean or 0.0)

    @property
    def most_successful(self) -> str:
        """Random or constant baseline with the highest success rate."""
        return max(self._blind, key=lambda name: self._blind[name].success.share or 0.0)

    @property
    def is_trivial(self) -> bool:
        """Whether that baseline is as good as a good policy has to be."""
        name = f"unsolved by {self.most_successful}"
        return name in self.quantities and self.quantities[name].level == 0

    @property
    def has_usable_oracle(self) -> bool:
        """Whether thresholds are relative to the oracle; without a usable one they are absolute."""
        return "oracle" in self.baselines and (
            (self.baselines["oracle"].success.share or 0.0) > USABLE
        )

    @property
    def _blind(self) -> dict[str, Figures]:
        return {name: of for name, of in self.baselines.items() if name != "oracle"}

    def as_dict(self) -> dict[str, Any]:
        """Return plain values, as in `verdict.json`."""
        return self.model_dump(mode="json")

    @property
    def line(self) -> str:
        """Its kind, whether that is certain, and the sentence."""
        return f"{self.kind.value}{'' if self.certain else ' (not certain)'}: {self.sentence}"
