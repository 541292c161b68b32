"""Results of a robustness evaluation: success rates under perturbations, the operating domain."""

import base64
import math
import zlib
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np
import pydantic
from numpy.typing import NDArray

from drone_rl.config.commands import Mode, ShiftSettings
from drone_rl.config.transforms import Fault
from drone_rl.sim.vocabulary import TaskVocabulary
from drone_rl.trust.axes_table import NAMES, TABLE
from drone_rl.trust.findings import Finding
from drone_rl.trust.results import Difference, GoalShare, Verdict
from drone_rl.utils.display import Result
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import Mean, Share
from drone_rl.utils.models import Model, Seeded, Stored
from drone_rl.utils.provenance import Provenance
from drone_rl.utils.text import at_most, listed, percent, render

FORMAT_VERSION = 2
MAX_NAMED = 6
"""Largest number of axes that a sentence names."""


def _known(name: str) -> str:
    if name not in TABLE:
        raise InputError(f"{name} is no axis; valid names: {', '.join(TABLE)}")
    return name


AxisName = Annotated[str, pydantic.AfterValidator(_known)]


class ModeFigures(Stored):
    """Figures of a policy under one condition."""

    success: Share
    difference: Mean | None = None
    """Of success, from that without perturbation, paired."""
    shares: dict[str, GoalShare] = {}
    """Mean fractions of goals reached: "all", and by stratum."""
    ends: dict[str, int] = {}
    """Number of episodes by the name of the end."""
    unchanged: bool = False
    """Whether no image and no episode differs from those without perturbation."""


class Plain(ModeFigures):
    """Figures without perturbation."""

    oracle: Share | None = None
    """Success rate of the task's oracle, if it has one."""


class ConditionFigures(Stored):
    """A condition, with figures of the policy by mode and of the oracle."""

    refused: str | None = None
    """Why the task or the camera does not allow it."""
    oracle: Share | None = None
    impossible: bool | None = None
    """Whether the oracle's success rate is too low; None without one."""
    modes: dict[Mode, ModeFigures] = {}

    @property
    def constant(self) -> ModeFigures:
        """Figures with constant perturbations."""
        return self.modes["constant"]


class Level(ConditionFigures):
    """One strength of an axis."""

    number: int
    """From 1, the weakest."""
    value: float
    """In the axis's unit."""
    position: float
    """On the axis's scale; 0 is no perturbation."""


class AlongAxis(Stored):
    """Figures at the strengths of one axis."""

    group: str
    unit: str
    neutral: float | None
    """The value without perturbation; None if it is infinite."""
    areas: dict[str, float | None] = {}
    """Mean height of the curve of success rate against strength, by mode."""
    levels: tuple[Level, ...]

    @property
    def allowed(self) -> list[Level]:
        """Strengths that task and camera allow."""
        return [level for level in self.levels if level.refused is None]

    @property
    def is_tested(self) -> bool:
        """Whether the strongest perturbation changed an image or an episode."""
        return bool(self.allowed) and not self.allowed[-1].constant.unchanged


class Side(Stored):
    """The stratum with the smallest fraction of goals reached."""

    side: str
    share: float


class Probe(Stored):
    """Whether a policy is certainly good under a condition."""

    good: bool
    """Certainly."""
    bad: bool = False
    """Certainly not good; neither if there are too few episodes."""
    refused: str | None = None
    """Why the task does not allow the condition; then the others are empty."""
    success: float | None = None
    """Success rate."""
    worst: Side | None = None


class FailedEnd(Probe):
    """The strength at which a side of a range ends."""

    end: Literal["low", "high"]
    value: float | None
    """In the axis's unit; None if infinite."""
    oracle: Share | None = None
    impossible: bool = False
    """Whether the oracle's success rate is too low."""


class RangeTest(Stored):
    """Episodes at strengths drawn uniformly and jointly from ranges, one each."""

    success: Share
    """Success rate over the ranges."""
    required: float
    """The success rate that a good policy exceeds, see `Rule.good_share`."""
    failed: tuple[dict[AxisName, float | None], ...] = ()
    """Values of the axes in the first episodes that failed; None if infinite."""
    refused: str | None = None
    """Why the task does not allow some of the strengths."""

    @property
    def is_passed(self) -> bool:
        """Whether the policy is certainly good over the ranges as a whole."""
        return self.refused is None and self.success.lower95 > self.required

    @property
    def fails_at_most(self) -> float:
        """Largest rate of failures at strengths drawn from the ranges, with 95% confidence."""
        return 1.0 - self.success.lower95


class Range(Stored):
    """The widest range of an axis in which the policy is certainly good."""

    low: float | None = None
    high: float | None = None
    """The ends in the axis's unit; None if infinite."""
    low_open: bool | None = None
    high_open: bool | None = None
    """Whether it is still good at the strongest perturbation of that side; None if the side has no
    strengths."""
    low_bad: float | None = None
    high_bad: float | None = None
    """The nearest tested values beyond the ends at which it is certainly not good; None without
    any. The limit of another seed lies before them."""
    test: RangeTest | None = None
    """New episodes over the whole range; None if it is a single strength."""
    positions: tuple[float, float] | None = None
    """The ends on the axis's scale, lower first; None if it is not certainly good even without
    perturbation."""
    failed: tuple[FailedEnd, ...] = ()
    """The strengths at which the sides end, lower values first."""

    @property
    def possible_failures(self) -> list[FailedEnd]:
        """Failures at strengths that are possible."""
        return [end for end in self.failed if not end.impossible]

    @property
    def is_wide(self) -> bool:
        """Whether it is more than a single strength, and new episodes confirmed it."""
        return self.test is not None and self.test.is_passed


class Domain(Stored):
    """The operating domain of a policy: by axis, the range in which it is good."""

    plain: Probe
    """Without perturbation."""
    ranges: dict[AxisName, Range]
    is_absolute: bool = False
    """Whether thresholds are absolute, since there is no usable oracle."""


class NetworkIdentity(Stored):
    """The network and the description of a policy."""

    weights: str
    """Hash of its weights."""
    description: dict[str, Any]

    @property
    def input_faults(self) -> list[str]:
        """Faults of the inputs in training: those of cameras, and errors of vectors."""
        faults = {fault.name for fault in Fault.__subclasses__()}
        steps = [
            step["name"]
            for seen in self.description["inputs"].values()
            for step in seen.get("transforms", ())
        ]
        errors = [
            f"{error} of {name}"
            for name, seen in self.description["inputs"].items()
            for error in ("noise", "bias", "delay", "loss")
            if seen.get(error)
        ]
        return [*(name for name in steps if name in faults), *errors]


class Robustness(Seeded, Provenance):
    """Success rates of a policy under perturbations, and its operating domain."""

    format: Literal["drone_rl shifts"] = "drone_rl shifts"
    format_version: Literal[2] = FORMAT_VERSION
    policy: str
    """Its name."""
    network: NetworkIdentity | None
    """None for a third-party policy."""
    settings: Annotated[
        ShiftSettings,
        pydantic.BeforeValidator(
            lambda v: v if isinstance(v, ShiftSettings) else ShiftSettings.read(v, "settings")
        ),
        pydantic.PlainSerializer(lambda settings: settings.values(), dict[str, Any]),
    ]
    terms: TaskVocabulary
    plain: Plain
    axes: dict[AxisName, AlongAxis]
    together: ConditionFigures
    """All axes combined, each at its third strength."""
    domain: Domain | None
    seconds: float = 0.0
    unlike: dict[str, Difference] = {}
    """Settings that differ from the training, by name."""
    image_size: tuple[int, int] = (0, 0)
    """Rows and columns of a camera image."""
    pictures: dict[AxisName, tuple[str | None, ...]] = {}
    """Packed images of the camera by axis, see `frames`."""

    @property
    def area(self) -> float:
        """Mean over axes of the area under the curve of success rate against strength."""
        areas = [along.areas.get("constant") for along in self.axes.values()]
        defined = [area for area in areas if area is not None]
        return sum(defined) / max(len(defined), 1)

    @property
    def weakest(self) -> tuple[str, Level] | None:
        """The axis and strength, possible for the oracle, with the fewest successful episodes."""
        levels = [(n, level) for n, of in self.axes.items() for level in of.allowed]
        possible = (at for at in levels if not at[1].impossible)
        return min(possible, key=lambda at: at[1].constant.success.share or 0.0, default=None)

    @property
    def sentence(self) -> str:
        """The operating domain as text."""
        return render("drone_rl.trust", "shifts.j2", s=self)

    @property
    def ranges(self) -> Mapping[str, Range]:
        """Ranges of the operating domain by axis; empty if they were not searched."""
        return {} if self.domain is None else self.domain.ranges

    @property
    def wide(self) -> list[str]:
        """Axes with a range in which the policy is good."""
        return [n for n, found in self.ranges.items() if found.is_wide and self.axes[n].is_tested]

    @property
    def shut(self) -> dict[str, FailedEnd]:
        """Axes on which it is certainly not good next to no perturbation, with that failure."""
        return {
            name: end
            for name, found in self.ranges.items()
            if found.positions == (0.0, 0.0)
            for end in found.possible_failures
            if end.bad
        }

    @property
    def refuted(self) -> dict[str, RangeTest]:
        """Axes with a range that new episodes did not confirm, with these episodes."""
        tests = ((name, found.test) for name, found in self.ranges.items())
        return {NAMES[name]: of for name, of in tests if of and not of.is_passed}

    @property
    def uncertain(self) -> list[tuple[str, FailedEnd]]:
        """Axes and the ends of sides at which it is neither certainly good nor certainly not."""
        ends = ((name, end) for name, of in self.ranges.items() for end in of.possible_failures)
        return [(name, end) for name, end in ends if not end.bad]

    @property
    def impossible(self) -> dict[str, float]:
        """Strengths and ends of ranges that are impossible, with the oracle's success rate."""
        return {
            self.at(name, at.value): at.oracle.share or 0.0
            for name, along in self.axes.items()
            for at in (*(self.ranges[name].failed if name in self.ranges else ()), *along.levels)
            if at.impossible and at.oracle is not None
        }

    @property
    def untested(self) -> dict[str, str]:
        """Axes that were not tested, with the reason."""
        return {
            NAMES[name]: "no effect" if along.allowed else "no strength is allowed"
            for name, along in self.axes.items()
            if not along.is_tested
        }

    @property
    def axes_named(self) -> str:
        """The axes by name, or their number if there are many."""
        names = [NAMES[name] for name in self.axes]
        return listed(names) if len(names) <= MAX_NAMED else f"{len(names)} axes"

    def at(self, name: str, value: float | None) -> str:
        """Return a value of an axis as text."""
        return f"{NAMES[name]} at {number(value)} {self.axes[name].unit}"

    @property
    def range_texts(self) -> list[str]:
        """The ranges of `wide` as text."""
        return [self._range_text(name) for name in self.wide]

    def _range_text(self, name: str) -> str:
        found = self.ranges[name]
        low, high = found.low, found.high
        entry = TABLE[name]
        text = entry["range"] if high is None else entry.get("bounded", entry["range"])
        limits = {
            **({} if low is None else {"low": inward(low, up=True)}),
            **({} if high is None else {"high": inward(high, up=False)}),
        }
        text = text.format(objects=self.terms.targets, **limits)
        lost = {failed.end for failed in found.failed if failed.impossible}
        aside = []
        for end, most in (("low", "no less"), ("high", "no more")):
            bad = getattr(found, f"{end}_bad")
            if getattr(found, f"{end}_open"):
                aside.append(f"{most} was tried")
            elif end in lost:
                aside.append(f"{most} is possible")
            elif bad is not None:
                aside.append(f"certainly not at {number(bad)}")
        if found.test is not None:
            most = at_most(found.test.fails_at_most)
            aside.append(f"fails in at most {most} of episodes at strengths drawn from it")
        return f"{text} ({listed(aside)})" if aside else text

    def frames(self, name: str) -> list[NDArray[np.uint8] | None]:
        """Return camera images of an axis: without perturbation, then at each of five strengths.

        None if the task does not allow the strength. Shapes: (H, W, 3).

        Raises:
            InputError: An image has another size.
        """
        strip = self.pictures.get(name, ())
        if len(strip) != 6 or strip[0] is None:
            raise InputError(
                f"pictures.{name} has no image without perturbation, or not six images"
            )
        where = f"pictures.{name}"
        return [None if text is None else unpacked(text, self.image_size, where) for text in strip]

    def requirements(self) -> dict[str, dict[str, Any]]:
        """Return the operating domain in the format of `require_domain`."""
        return {
            name: {end: value for end in ("low", "high") if (value := getattr(of, end)) is not None}
            | {"unit": self.axes[name].unit}
            for name, of in self.ranges.items()
            if of.positions and self.axes[name].is_tested and NAMES[name] not in self.refuted
        }

    def table(self) -> list[list[str]]:
        """Return the success rates as a table: a header, then a row for each axis."""
        table = [["success, constant", "1", "2", "3", "4", "5", "area", ""]]
        for name, along in self.axes.items():
            cells = {level.number: _cell(level) for level in along.levels}
            area = along.areas.get("constant")
            shares = [cells.get(number, "") for number in range(1, 6)]
            table.append([NAMES[name], *shares, "" if area is None else f"{area:.2f}", along.unit])
        return table


class SavedShifts(Stored):
    """A robustness evaluation read from a file, or the reason why it is refused."""

    path: str
    """The file."""
    dated: str = ""
    """When it was written."""
    refused: str | None = None
    """The reason, in one line."""
    shifts: Robustness | None = None
    """None if refused."""

    def why_not(self, verdict: Verdict) -> str | None:
        """Return why a verdict can't quote it, or None."""
        if self.shifts is None:
            return self.refused
        if self.shifts.settings.good_share != verdict.good_share:
            return (
                f"it requires {self.shifts.settings.good_share:g} of the oracle's success rate for "
                f"a good policy, this verdict {verdict.good_share:g}"
            )
        domain, is_other = self.shifts.domain, verdict.certain and verdict.kind != "good"
        if is_other and domain is not None and domain.plain.good:
            return (
                "it states that the policy is good without perturbation, and this verdict does not"
            )
        return None

    def finding(self, verdict: Verdict) -> Finding:
        """Return the evaluation in a line, or why a verdict does not quote it."""
        why, shifts, effect = self.why_not(verdict), self.shifts, 0.0
        text = render("drone_rl.trust", "shifts_finding.j2", of=self, why=why)
        if shifts is None or why:
            return Finding(text=text)
        if shifts.weakest is not None:
            worst = shifts.weakest[1].constant.success
            effect = max(0.0, (shifts.plain.success.share or 0.0) - (worst.share or 0.0))
        tested = frozenset(along.group for along in shifts.axes.values())
        return Finding(text=text, effect=effect, tested=tested, section="shifts")


def find(
    verdict: Verdict, measured: SavedShifts | None, others: Sequence[Finding] = ()
) -> tuple[Finding, ...]:
    """Return the findings of a verdict, of a robustness evaluation, and others, by effect."""
    shifted = [] if measured is None else [measured.finding(verdict)]
    every = [*verdict.own_findings, *shifted, *others]
    return tuple(sorted(every, key=lambda finding: -finding.effect))


class Need(Model):
    """Required range of an axis; None stands for the value without perturbation."""

    low: Annotated[float, pydantic.Field(strict=True, ge=-1e9, le=1e9)] | None = None
    high: Annotated[float, pydantic.Field(strict=True, ge=-1e9, le=1e9)] | None = None
    unit: str


class Coverage(Result, Seeded):
    """A required operating domain, tested as a whole."""

    needs: dict[str, Need]
    """Required ranges by axis."""
    test: RangeTest | None = None
    """None if no episodes were run."""

    @property
    def is_covered(self) -> bool:
        """Whether the policy is certainly good over the required ranges together."""
        return self.test is not None and self.test.is_passed

    def __str__(self) -> str:
        """Return whether it is covered, and the evidence."""
        return render("drone_rl.trust", "coverage.j2", c=self)


def inward(value: float, *, up: bool) -> str:
    """Return a limit in three digits, rounded into the range; `up` for a lower limit."""
    if value == 0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - 2)
    count = value / unit
    return f"{(math.ceil(count - 1e-6) if up else math.floor(count + 1e-6)) * unit:.3g}"


def number(value: float | None) -> str:
    """Return a value of an axis in three digits; None is infinite."""
    return "none" if value is None else f"{value:.3g}"


def packed(image: NDArray[np.uint8]) -> str:
    """Encode an image as text."""
    return base64.b64encode(zlib.compress(image.tobytes(), 9)).decode()


def unpacked(text: str, size: tuple[int, int], where: str) -> NDArray[np.uint8]:
    """Decode an image of `packed` with so many rows and columns; else raise an `InputError`."""
    length = 3 * math.prod(size)
    try:
        content = zlib.decompressobj().decompress(base64.b64decode(text, validate=True), length + 1)
    except (ValueError, zlib.error):
        content = b""
    if len(content) != length:
        raise InputError(f"{where} is not an image of {size[0]} rows and {size[1]} columns")
    return np.frombuffer(content, np.uint8).reshape(*size, 3)


def _cell(level: Level) -> str:
    if level.refused is not None:
        return f"{number(level.value)}: -"
    return (
        f"{number(level.value)}: {percent(level.constant.success.share or 0.0)}"
        f"{'*' if level.impossible else ''}"
    )
