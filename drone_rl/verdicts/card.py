"""The card of an exported policy: its verdict, its figures, and where they come from."""

from drone_rl.evaluation.verdict_text import best_baseline, is_quoted
from drone_rl.robustness.domain_text import QUOTED, untested
from drone_rl.robustness.domain_text import is_quoted as has_domain
from drone_rl.sim.vocabulary import some_cubes, terms_of
from drone_rl.utils.text import Evidence, Sentence, listed, said, say


def write_card(name: str, digest: str, about: Evidence) -> str:
    """Return the card as Markdown.

    Args:
        name: Of the policy.
        digest: SHA-256 of its file.
        about: The file's metadata: "command", "progress", "provenance", "verdict" (as in
            verdict.json), "worlds" (its stream of environments), "seed", "chosen" (None, or "runs"
            and "episodes" of the sweep), "task", "dynamics" (None in computer-vision mode),
            "shifts" (None, or as in shifts.json).
    """
    sentences = said(SENTENCES, about)
    verdict = sentences.pop("card.verdict")
    known = about["provenance"]["versions"]
    packages = {name: known.get(name, "unknown") for name in ("torch", "torchrl", "mujoco-warp")}
    revision = about["provenance"]["git_revision"] or "unknown"
    points = "\n".join(f"- {text}" for text in sentences.values())
    return f"""# {name}

{verdict}

{_flights(about["verdict"])}

{_failures(about["verdict"]["failures"])}

{points}
- Trained by `{about["command"]}` in {about["progress"]["frames"]:,} frames; its description is in \
the file's metadata.
- SHA-256 of `{name}.safetensors`: `{digest}`
- revision {revision}; torch {packages["torch"]}, torchrl {packages["torchrl"]}, mujoco-warp \
{packages["mujoco-warp"]}
"""


def _flights(verdict: Evidence) -> str:
    """Table of greedy and sampled actions, the best random or constant baseline, and the oracle."""
    best = best_baseline(verdict)
    flown = {
        "most probable actions": verdict["greedy"],
        "sampled actions": verdict["sampled"],
        f"best blind baseline ({best})": verdict["baselines"][best],
        "oracle": verdict["baselines"]["oracle"],
    }
    flown = {name: flights for name, flights in flown.items() if flights is not None}
    rows = [["", *flown], ["---"] * (1 + len(flown))]
    terms = terms_of(verdict)
    rows.append(
        [f"episodes with all {terms.goals}", *(_share(f["success"]) for f in flown.values())]
    )
    for side in verdict["greedy"]["shares"]:
        label = f"{terms.goals} {terms.reached}" if side == "all" else f"of those {side}"
        rows.append([label, *(_share(f["shares"][side]) for f in flown.values())])
    return _table(rows)


def _failures(failures: Evidence) -> str:
    """Rows of the failure table with failures, largest first."""
    largest = failures["largest"]
    if largest is None:
        upper = f"{100 * failures['bound']['upper95']:.1f}% of episodes"
        return _table([["fails", "never"], ["---"] * 2, ["upper bound", upper]])
    failed = [row for row in failures["rows"] if row["failed"] and row != largest]
    rows = [
        [f"{row['by']}: {row['value']}", str(row["failed"]), str(row["episodes"]), _share(row)]
        for row in (largest, *failed)
    ]
    return _table([["fails first at", "episodes", "of", "share"], ["---"] * 4, *rows])


def _table(rows: list[list[str]]) -> str:
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _share(value: Evidence) -> str:
    """A rate or a mean with its interval."""
    middle = value["share"] if "share" in value else value["mean"]
    if middle is None:
        return "not offered"
    return f"{middle:.3f} ({value['lower95']:.3f} to {value['upper95']:.3f})"


def _verdict(card: Evidence) -> str:
    verdict = card["verdict"]
    certain = f"certain, with a chance of error of at most {100 * verdict['error_rate']:g}%"
    return (
        f"**{verdict['kind']}** ({certain if verdict['certain'] else 'not certain'}): "
        f"{verdict['sentence']}"
    )


def _reported(card: Evidence) -> str:
    but = " but those of the certificate" if is_quoted(card["verdict"]) else ""
    return (
        f"All figures{but} are of {card['verdict']['greedy']['episodes']:,} episodes in worlds to "
        f"report on (seed {card['seed']}), which neither a training nor the choice in a sweep uses."
    )


def _chosen(card: Evidence) -> str:
    chosen = card["chosen"]
    text = f"It is one of the {chosen['runs']} runs of a sweep"
    if chosen["episodes"] is None:
        return f"{text}, in which it was not judged."
    return f"{text}, which are compared by {chosen['episodes']} episodes in worlds to choose by."


def _tested(card: Evidence) -> str:
    tested = terms_of(card["verdict"]).tested or some_cubes(card["task"])
    unknown = listed(untested(card), "or")
    but = f": nothing is known of other {unknown}" if unknown else ", but for what is said here"
    what = "The verdict is of" if has_domain(card) else "Tested with"
    return f"{what} {tested}, in this task's look and light only{but}."


def _flies(card: Evidence) -> bool:
    dynamics = card.get("dynamics")
    return dynamics is not None and dynamics["mode"] == "simple_flight"


def _body(card: Evidence) -> str:
    dynamics = card["dynamics"]
    speed = sum(along**2 for along in dynamics["wind"]) ** 0.5
    gusts = f"gusts of {dynamics['gusts']:g} m/s" if dynamics["gusts"] else ""
    wind = f"wind of {speed:.3g} m/s" if speed else ""
    air = " and ".join(filter(None, (wind, gusts))) or "still air"
    every = dynamics["control_ticks"] * dynamics["tick"]
    return (
        f"Its drone has a body: a quadrotor of {dynamics['mass']:g} kg in {air}, told what to do "
        f"every {every:.3g} s; nothing is known here of other drones, air or modes (drone-rl "
        "bodies)."
    )


SENTENCES = (
    Sentence("card.verdict", "always", lambda c: True, _verdict),
    Sentence(
        "card.intervals",
        "always",
        lambda c: True,
        lambda c: (
            "In brackets: 95% intervals that count episodes, whatever depends on what within one; "
            "those of the failures hold all at once."
        ),
    ),
    Sentence(
        "card.reported",
        "the figures are from worlds to report on",
        lambda c: c["worlds"] == "report",
        _reported,
    ),
    Sentence(
        "card.chosen",
        "the run lies in a sweep's folder",
        lambda c: c["chosen"] is not None,
        _chosen,
    ),
    Sentence(
        "card.not_chosen",
        "the run does not lie in a sweep's folder",
        lambda c: c["chosen"] is None,
        lambda c: "Whether it was chosen among several trainings, and how, is not recorded.",
    ),
    Sentence("card.tested", "always", lambda c: True, _tested),
    Sentence("card.body", "its drone has a body", _flies, _body),
    Sentence(
        "card.domain",
        "a robustness evaluation is of this network and task, and not refused",
        has_domain,
        lambda c: say(QUOTED, c),
    ),
    Sentence(
        "card.greedy_only",
        "no episodes with sampled actions were run",
        lambda c: c["verdict"]["sampled"] is None,
        lambda c: "No episodes with sampled actions were run.",
    ),
    Sentence(
        "card.use",
        "always",
        lambda c: True,
        lambda c: (
            "Intended use: to study what a policy sees and whether to trust it, in this simulator; "
            "not for a real drone."
        ),
    ),
)
