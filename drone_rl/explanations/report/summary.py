"""The summary on top of the report: a line for each question, from the results of its sections."""

from collections.abc import Mapping
from typing import Any

from drone_rl.explanations.report.explanation import METHOD_NAMES
from drone_rl.sim.vocabulary import terms_of
from drone_rl.trust import quoted_text, shifts_text
from drone_rl.trust.rule import Kind
from drone_rl.trust.verdict_text import is_proved, is_quoted, is_stated
from drone_rl.utils.text import Claims, Evidence, listed, plural, rate

LINES: Mapping[str, tuple[str, str]] = {
    "verdict": ("Verdict", "evaluation"),
    "success": ("Success rate", "evaluation"),
    "robustness": ("Robustness", "shifts"),
    "certificate": ("Verification", "evaluation"),
    "map": ("Exact map", "places"),
    "heat": ("Heat maps", "truth"),
    "limits": ("Not shown", "left_out"),
}
"""Label and section of each line, by the word after "summary." in the names of its claims."""
_SECTIONS = {
    "dataset": ("dataset", "rollouts"),
    "embedding": ("tsne", "t-SNE"),
    "class_models": ("class_model", "class models"),
    "attribution": ("attribution", "heat maps"),
    "flaws": ("contradictions", "contradictions and loops"),
    "response": ("response", "response map"),
    "asymmetry": ("asymmetry", "asymmetry"),
}
"""Sections that only the line "Not shown" mentions: entry of explanation.json, and display name."""


def say_summary(evidence: Evidence) -> Claims:
    """Say in short what the sections show, and what is not shown."""
    return {
        **(_say_verdict(evidence) if evidence.get("verdict") else _missing("verdict")),
        **_say_robustness(evidence),
        **_say_verification(evidence),
        **(_say_heat(evidence["truth"]) if evidence.get("truth") else _missing("heat")),
        **_say_limits(evidence),
    }


def _missing(line: str) -> Claims:
    return {f"summary.{line}_missing": "Not run; drone-rl explain adds it."}


def _say_verdict(evidence: Evidence) -> Claims:
    verdict, terms, claims = evidence["verdict"], terms_of(evidence), Claims()
    greedy, kind = verdict["greedy"], verdict["kind"]
    kind = "neither good nor poor nor one-sided" if kind == str(Kind.NONE) else kind
    if verdict["certain"]:
        claims["summary.verdict"] = (
            f"{kind.capitalize()}. This verdict is wrong with at most "
            f"{100 * verdict['error_rate']:g}% probability."
        )
    else:
        claims["summary.verdict_open"] = (
            f"Not certain: the evidence suggests {kind}, but does not decide it."
        )
    claims["summary.success"] = (
        f"The most probable actions have every {terms.goal} {terms.reached} in "
        f"{rate(greedy['success'])} of {greedy['episodes']:,} episodes."
    )
    return claims


def _say_robustness(evidence: Evidence) -> Claims:
    shifts = evidence.get("shifts")
    if not shifts:
        return {
            "summary.robustness_unknown": (
                "Not measured; run drone-rl shifts on this policy and explain it again."
            )
        }
    if not quoted_text.is_quoted(evidence):
        why = quoted_text.why_not(evidence)
        return {"summary.robustness_refused": f"Measured, but not shown here: {why}."}
    count = plural(len(shifts["axes"]), "perturbation")
    if shifts["domain"] is None:
        return {"summary.robustness_table": f"Success rates under {count}."}
    tested = [name for name in shifts["axes"] if shifts_text.is_tested(shifts, name)]
    count = plural(len(tested), "perturbation")
    wide = [shifts_text.NAMES[name] for name in shifts_text.wide(shifts)]
    names = f": {listed(wide)}" if wide else ""
    return {
        "summary.robustness": (
            f"Good with 95% confidence in a range of {len(wide)} of {count} tested{names}."
        )
    }


def _say_verification(evidence: Evidence) -> Claims:
    verdict, claims = evidence.get("verdict") or {}, Claims()
    if verdict and is_proved(verdict):
        claims["summary.certificate"] = (
            "A certificate of success from every placement was re-checked by "
            f"{verdict['proof']['checked']:,} rollouts."
        )
    elif verdict and is_quoted(verdict):
        part = "every placement" if is_stated(verdict) else "a part of the placements"
        claims["summary.certificate_partly"] = (
            f"A certificate states success from {part}, but it is not a proof for all of them: see "
            "the verdict."
        )
    else:
        claims["summary.certificate_none"] = (
            "No accepted certificate; for the collection of cubes, drone-rl prove searches for one."
        )
    places = evidence.get("places")
    if not places:
        claims |= _missing("map")
    elif "refused" in places:
        claims["summary.map_refused"] = f"None: {places['refused']}."
    else:
        window = places["window"]
        claims["summary.map"] = (
            "Its most probable action is computed for every place of one cube, "
            f"{window['nearest']:g} to {window['farthest']:g} m ahead."
        )
    return claims


def _say_heat(truth: Mapping[str, Any]) -> Claims:
    methods = truth["methods"]
    passed = [str(METHOD_NAMES.get(n, n)) for n, of in methods.items() if of["trusted"]]
    if passed:
        return {
            "summary.heat": (
                f"Trust {listed(passed)}: {len(passed)} of {len(methods)} methods passed the tests."
            )
        }
    if methods:
        return {
            "summary.heat_none": (
                f"None of {len(methods)} methods passed the tests: trust no heat map."
            )
        }
    return {"summary.heat_untested": "No method could be tested: trust no heat map."}


def _say_limits(evidence: Evidence) -> Claims:
    parts = ["real cameras and drones"]
    if evidence.get("verdict") and (names := quoted_text.not_evaluated(evidence)):
        parts.append(f"other {listed(names, 'or')}")
    left_out = evidence.get("left_out") or {}
    if left_out:
        names = [name.replace("_", " ") for name in left_out]
        parts.append(f"what was left out ({', '.join(names)})")
    missing = [
        label
        for section, (key, label) in _SECTIONS.items()
        if section not in left_out and evidence.get(key) is None
    ]
    if missing:
        parts.append(f"what was not run ({', '.join(missing)}; drone-rl explain adds it)")
    text = listed(parts)
    return {"summary.limits": f"{text[0].upper()}{text[1:]}."}
