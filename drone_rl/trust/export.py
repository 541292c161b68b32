"""`drone-rl export`: write a policy as safetensors with a model card."""

import hashlib
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from safetensors import SafetensorError

from drone_rl.config.commands import HeldOutSettings
from drone_rl.policies.policy import Policy
from drone_rl.policies.zoo import certificate_path, shifts_path
from drone_rl.policies.zoo.files import exported_bytes
from drone_rl.sim.vocabulary import some_cubes, terms_of
from drone_rl.trust.coverage import find_domain
from drone_rl.trust.evaluate import held_out_environments
from drone_rl.trust.shifts_text import QUOTED, not_evaluated
from drone_rl.trust.shifts_text import is_quoted as has_domain
from drone_rl.trust.verdict import FindClaim, Verdict, judge_policy
from drone_rl.trust.verdict_text import best_baseline, is_quoted
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes, write_all_atomically
from drone_rl.utils.limits import CERTIFICATE_BYTES, SHIFTS_BYTES
from drone_rl.utils.overrides import COMMAND, read_overrides
from drone_rl.utils.schema import Maybe
from drone_rl.utils.seeding import with_seed
from drone_rl.utils.text import Evidence, Sentence, hundredfold, listed, rate, said, say


def export(
    policy: Policy,
    target: Path,
    settings: HeldOutSettings,
    *,
    command: str | None = None,
    chosen: Mapping[str, Any] | None = None,
    certificate: str | Path | None = None,
    shifts: str | Path | None = None,
    outputs: str | Path = "outputs",
    find_claim: FindClaim | None = None,
) -> Verdict:
    """Judge a policy and write it as safetensors with a model card, next to the verdict.

    Args:
        policy: The policy.
        target: The file, ending in .safetensors.
        settings: Settings of the card's verdict.
        command: The training command; None takes it from the policy's file or folder.
        chosen: How it was chosen in a sweep, see `export_policy`; None takes it from the policy's
            file.
        certificate: See `find_claim`; it is quoted and copied, like the robustness evaluation.
        shifts: See `find_domain`.
        outputs: See `find_domain`.
        find_claim: Finds and checks certificates, see `judge`.

    Returns:
        The verdict.

    Raises:
        InputError: The policy can't be written, or a given file is unusable.
    """
    settings, seed = with_seed(settings)
    noted, noted_choice = recorded_origin(policy.path, policy.state)
    command, chosen = Maybe(COMMAND).read(command or noted, "command"), chosen or noted_choice
    claim = None if find_claim is None else find_claim(policy, certificate, seed=seed)
    claim = None if claim is None or claim.refused else claim  # cards quote no refused certificate
    measured = find_domain(policy, shifts, outputs)
    with held_out_environments(policy, settings, seed) as (env, actor):
        judged = judge_policy(env, actor, settings.episodes, claim=claim, seed=seed)
    verdict = judged.as_dict()
    carried, numbers = {}, measured and measured.numbers
    if numbers is not None:  # the card names the copied file, without its folder
        numbers = {**numbers, "file": {**numbers["file"], "path": shifts_path(target).name}}
    if measured is not None and has_domain({"shifts": measured.evidence, "verdict": verdict}):
        carried[shifts_path(target)] = read_bytes(measured.path, SHIFTS_BYTES)
    if claim is not None and is_quoted(verdict):
        carried[certificate_path(target)] = read_bytes(claim.path, CERTIFICATE_BYTES)
    about: dict[str, Any] = {"verdict": verdict, "seed": seed.value, "chosen": chosen}
    about |= {"command": command, "shifts": numbers, "carried": carried}
    export_policy(target, policy.state, **about)
    return judged


def recorded_origin(path: Path, state: dict[str, Any]) -> tuple[str | None, dict[str, Any] | None]:
    """Return the training command of a run or exported file, and the file's "chosen", if any.

    The command is None if it is unknown, as of a run that was trained from Python.
    """
    metadata = state if path.suffix == ".safetensors" else {}  # nobody checked that of a checkpoint
    noted, folder = metadata.get("command"), path.absolute().parent.parent
    if noted is None and (folder / ".hydra" / "overrides.yaml").is_file():
        typed = [o for o in read_overrides(folder) if not o.startswith(("resume=", "trial="))]
        noted = shlex.join(["drone-rl", "train", *typed])
    return noted, metadata.get("chosen")


def export_policy(
    path: Path,
    checkpoint: Mapping[str, Any],
    *,
    command: str | None,
    verdict: Mapping[str, Any],
    seed: int,
    chosen: Mapping[str, Any] | None,
    shifts: Mapping[str, Any] | None = None,
    carried: Mapping[Path, bytes] | None = None,
) -> None:
    """Write a checkpoint's policy and its model card, .safetensors and .md, both or neither.

    `checkpoint` is from `read_policy`, `verdict` and `shifts` are as in verdict.json and
    shifts.json, `seed` is the root of the verdict's random streams. `chosen` has "runs", the
    number of runs in the policy's sweep, and "episodes", the number by which it was judged there;
    None outside a sweep. `carried` are further files that the card quotes, by their paths.

    Raises:
        InputError: The files can't be written.
    """
    origin = checkpoint["provenance"]
    about = {
        "progress": checkpoint["progress"],
        "provenance": {k: origin[k] for k in ("versions", "git_revision")},
        "command": Maybe(COMMAND).read(command, "command"),
        "verdict": verdict,
        "worlds": "report",
        "seed": seed,
        "chosen": chosen,
    }
    described = checkpoint["description"]
    try:
        content = exported_bytes(checkpoint["policy"], described, about)
    except SafetensorError as error:
        raise InputError(f"policy {path} can't be written ({error})") from error
    names = ("task", "appearance", "dynamics")
    origin = {**{name: described.get(name) for name in names}, "shifts": shifts}
    digest = hashlib.sha256(content).hexdigest()
    card = write_card(path.stem, digest, {**about, **origin})
    try:
        write_all_atomically({path: content, path.with_suffix(".md"): card, **(carried or {})})
    except OSError as error:
        raise InputError(
            f"policy {path} can't be written ({error.filename}: {error.strerror}); free some "
            "space or choose another folder with hydra.run.dir=..."
        ) from error


def write_card(name: str, digest: str, about: Evidence) -> str:
    """Return the card as Markdown.

    Args:
        name: Name of the policy.
        digest: SHA-256 of its file.
        about: The file's metadata: "command", "progress", "provenance", "verdict" (as in
            verdict.json), "worlds" (its stream of environments), "seed", "chosen" (None, or "runs"
            and "episodes" of the sweep), "task", "dynamics" (None in computer-vision mode),
            "shifts" (None, or as in shifts.json).
    """
    sentences = said(SENTENCES, about)
    verdict = sentences.pop("card.verdict")
    versions = about["provenance"]["versions"]
    packages = {name: versions.get(name, "unknown") for name in ("torch", "torchrl", "mujoco-warp")}
    revision = about["provenance"]["git_revision"] or "unknown"
    points = "\n".join(f"- {text}" for text in sentences.values())
    by = "" if about["command"] is None else f"by `{about['command']}` "
    return f"""# {name}

{verdict}

{_flights(about["verdict"])}

{_failures(about["verdict"]["failures"])}

{points}
- Trained {by}for {about["progress"]["frames"]:,} frames; the file's metadata \
contains its description.
- SHA-256 of `{name}.safetensors`: `{digest}`
- revision {revision}; torch {packages["torch"]}, torchrl {packages["torchrl"]}, mujoco-warp \
{packages["mujoco-warp"]}
"""


def _flights(verdict: Evidence) -> str:
    """Return a table of greedy and sampled actions, the best blind baseline, and the oracle."""
    best = best_baseline(verdict)
    columns = {
        "most probable actions": verdict["greedy"],
        "sampled actions": verdict["sampled"],
        f"best blind baseline ({best})": verdict["baselines"][best],
        "oracle": verdict["baselines"]["oracle"],
    }
    columns = {name: flights for name, flights in columns.items() if flights is not None}
    terms = terms_of(verdict)
    successes = (rate(flights["success"], label="") for flights in columns.values())
    rows = [["", *columns], [f"episodes with all {terms.goals}", *successes]]
    for side in verdict["greedy"]["shares"]:
        label = f"{terms.goals} {terms.reached}" if side == "all" else f"of those {side}"
        rows.append([label, *(rate(f["shares"][side], label="") for f in columns.values())])
    return _table(rows)


def _failures(failures: Evidence) -> str:
    """Return the rows of the failure table that have failures, largest first."""
    largest = failures["largest"]
    if largest is None:
        upper = f"{hundredfold(failures['bound']['upper95'])}% of episodes"
        return _table([["fails", "never"], ["upper bound", upper]])
    failed = [row for row in failures["rows"] if row["failed"] and row != largest]
    rows = [
        [f"{r['by']}: {r['value']}", str(r["failed"]), str(r["episodes"]), rate(r, label="")]
        for r in (largest, *failed)
    ]
    return _table([["fails first at", "episodes", "of", "rate"], *rows])


def _table(rows: list[list[str]]) -> str:
    head, *rest = rows
    lines = [head, ["---"] * len(head), *rest]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _verdict(card: Evidence) -> str:
    verdict = card["verdict"]
    certain = f"certain, with a chance of error of at most {100 * verdict['error_rate']:g}%"
    return (
        f"**{verdict['kind']}** ({certain if verdict['certain'] else 'not certain'}): "
        f"{verdict['sentence']}"
    )


def _reported(card: Evidence) -> str:
    others = ["the certificate"] if is_quoted(card["verdict"]) else []
    others += ["the robustness evaluation"] if has_domain(card) else []
    but = f" except those of {listed(others)}" if others else ""
    return (
        f"All figures{but} are from {card['verdict']['greedy']['episodes']:,} episodes in "
        f"environments reserved for reports (seed {card['seed']}), which neither training nor the "
        "selection in a sweep uses."
    )


def _chosen(card: Evidence) -> str:
    chosen = card["chosen"]
    if chosen["runs"] == 1:
        return "It is the only run of a sweep, so it was not chosen among several."
    text = f"It is one of the {chosen['runs']} runs of a sweep"
    if chosen["episodes"] is None:
        return f"{text}, in which it was not judged."
    return (
        f"{text}, which were compared by {chosen['episodes']} episodes in environments reserved "
        "for selection."
    )


def _tested(card: Evidence) -> str:
    task, tested = card["task"], terms_of(card["verdict"]).tested
    tested = tested or (f"task {task['name']}" if "name" in task else some_cubes(task))
    unknown = listed(not_evaluated(card), "or")
    but = f": nothing is known of other {unknown}" if unknown else ", except as stated here"
    what = "The verdict is for" if has_domain(card) else "Tested with"
    is_own = card.get("appearance") is None
    look = "this task's appearance" if is_own else "the appearance of its training"
    return f"{what} {tested}, with {look} only{but}."


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
        f"The drone has vehicle dynamics: a quadrotor of {dynamics['mass']:g} kg in {air}, with an "
        f"action every {every:.3g} s. The policy was not tested with other drones, air or modes "
        "(drone-rl bodies)."
    )


SENTENCES = (
    Sentence("card.verdict", "always", lambda c: True, _verdict),
    Sentence(
        "card.intervals",
        "always",
        lambda c: True,
        lambda c: (
            "In brackets: 95% intervals that count episodes, whose steps may depend on each other; "
            "those of the failures hold simultaneously."
        ),
    ),
    Sentence(
        "card.reported",
        "the figures are from environments reserved for reports",
        lambda c: c["worlds"] == "report",
        _reported,
    ),
    Sentence(
        "card.chosen",
        "the run is in a sweep's folder",
        lambda c: c["chosen"] is not None,
        _chosen,
    ),
    Sentence(
        "card.not_chosen",
        "the run is not in a sweep's folder",
        lambda c: c["chosen"] is None,
        lambda c: "Whether it was chosen among several training runs, and how, is not recorded.",
    ),
    Sentence("card.tested", "always", lambda c: True, _tested),
    Sentence("card.body", "the drone has vehicle dynamics", _flies, _body),
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
            "Intended use: to study how a policy uses its observations and whether to trust it, in "
            "this simulator; not for a real drone."
        ),
    ),
)
