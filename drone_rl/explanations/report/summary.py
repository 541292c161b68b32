"""The summary on top of the report: a line for each question, from the results of its sections."""

from collections.abc import Mapping

from drone_rl.explanations.report.behavior import quoted_shifts
from drone_rl.explanations.report.explanation import METHOD_NAMES
from drone_rl.sim.vocabulary import terms_of
from drone_rl.trust.axes_table import NAMES
from drone_rl.trust.results import Verdict
from drone_rl.trust.rule import VerdictKind
from drone_rl.trust.shifts_results import SavedShifts, not_evaluated
from drone_rl.utils.text import Claims, Evidence, listed, plural, rate

LINES: Mapping[str, tuple[str, str]] = {
    "summary.verdict": ("Verdict", "evaluation"),
    "summary.success": ("Success rate", "evaluation"),
    "summary.robustness": ("Robustness", "shifts"),
    "summary.certificate": ("Verification", "evaluation"),
    "summary.map": ("Exact map", "places"),
    "summary.heat": ("Heat maps", "truth"),
    "summary.limits": ("Not shown", "left_out"),
}
"""Label and section of each line."""


def say_summary(evidence: Evidence) -> Claims:
    """Say in short what the sections show, and what is not shown."""
    verdict, truth, places = (evidence.get(name) for name in ("verdict", "truth", "places"))
    claims, terms = Claims(), terms_of(evidence)
    if verdict:
        greedy = verdict["greedy"]
        claims["summary.verdict"] = _verdict(verdict)
        claims["summary.success"] = (
            f"The most probable actions have every {terms.goal} {terms.reached} in "
            f"{rate(greedy['success'])} of {greedy['episodes']:,} episodes."
        )
    claims["summary.robustness"] = _robustness(evidence)
    if verdict:
        claims["summary.certificate"] = _certificate(Verdict.read(verdict))
    if places:
        claims["summary.map"] = (
            f"None: {places['refused']}."
            if "refused" in places
            else "Its most probable action is computed for every place of one cube, "
            f"{places['window']['nearest']:g} to {places['window']['farthest']:g} m ahead."
        )
    if truth:
        methods = truth["methods"]
        trusted = [METHOD_NAMES[name] for name, result in methods.items() if result["trusted"]]
        claims["summary.heat"] = (
            f"{len(trusted)} of {len(methods)} methods passed the tests: trust "
            f"{listed(trusted) or 'no heat map'}."
        )
    claims["summary.limits"] = _limits(evidence)
    return claims


def _verdict(verdict: Evidence) -> str:
    kind = verdict["kind"]
    kind = "neither good nor poor nor one-sided" if kind == str(VerdictKind.NONE) else kind
    if not verdict["certain"]:
        return f"Not certain: the evidence suggests {kind}, but does not decide it."
    return (
        f"{kind.capitalize()}. This verdict is wrong with at most "
        f"{100 * verdict['error_rate']:g}% probability."
    )


def _robustness(evidence: Evidence) -> str:
    shifts = evidence.get("shifts")
    if not shifts:
        return "Not measured; run drone-rl shifts on this policy and explain it again."
    if (quoted := quoted_shifts(evidence)) is None:
        why = SavedShifts.read(shifts).why_not(Verdict.read(evidence["verdict"]))
        return f"Measured, but not shown here: {why}."
    if quoted.domain is None:
        return f"Success rates under {plural(len(quoted.axes), 'perturbation')}."
    tested = [name for name, along in quoted.axes.items() if along.is_tested]
    wide = [NAMES[name] for name in quoted.wide]
    return (
        f"Good with 95% confidence in a range of {len(wide)} of "
        f"{plural(len(tested), 'perturbation')} tested{': ' if wide else ''}{listed(wide)}."
    )


def _certificate(verdict: Verdict) -> str:
    if (proof := verdict.quoted) is not None:
        if verdict.is_proved:
            return (
                "A certificate of success from every placement was re-checked by "
                f"{proof.checked:,} rollouts."
            )
        part = "every placement" if proof.every else "a part of the placements"
        return (
            f"A certificate states success from {part}, but it is not a proof for all of them: see "
            "the verdict."
        )
    return "No accepted certificate; for the collection of cubes, drone-rl prove searches for one."


def _limits(evidence: Evidence) -> str:
    parts = ["Real cameras and drones"]
    if evidence.get("verdict") and (names := not_evaluated(quoted_shifts(evidence))):
        parts.append(f"other {listed(names, 'or')}")
    if left_out := evidence.get("left_out"):
        parts.append(f"what was left out ({', '.join(left_out).replace('_', ' ')})")
    return f"{listed(parts)}."
