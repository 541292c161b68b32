"""Evaluations and verdicts, as objects that show themselves."""

import dataclasses
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any, cast, overload

from tensordict.nn import TensorDictModuleBase
from torchrl.envs import EnvBase

from drone_rl.api.domains import Coverage, beside, find_domain, require, sentence
from drone_rl.api.foreign import as_pilot
from drone_rl.api.judgements import Judgements
from drone_rl.api.pilot import Pilot
from drone_rl.api.progress import Bar, Progress
from drone_rl.api.quoting import find_claim
from drone_rl.api.reflying import refly
from drone_rl.api.showing import aligned, interval, paragraph, table
from drone_rl.conditions.measured import Measured
from drone_rl.envs import DroneEnv, worlds_of
from drone_rl.evaluation import StepLog, run_episodes, summarise
from drone_rl.evaluation.fragility import compare
from drone_rl.policies.foreign import Logits
from drone_rl.settings.changes import Changes
from drone_rl.settings.judging import EvaluateSettings, FlightSettings, JudgeSettings
from drone_rl.sim.settings import DynamicsSettings, TaskSettings
from drone_rl.sim.tasks import as_task
from drone_rl.utils.errors import InputError
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seeding import RootSeed, Stream, root_seed, torch_generator, with_seed
from drone_rl.verdicts.judge import Verdict, judge_policy
from drone_rl.verdicts.kinds import NOT_COVERED, NOT_PROVED
from drone_rl.verdicts.luck import BASELINES, fly_baselines, make_baseline
from drone_rl.verdicts.rule import Rule
from drone_rl.words.evaluation import EVALUATION
from drone_rl.words.licence import say
from drone_rl.words.seeds import seed_line
from drone_rl.words.verdict import quantity_label
from drone_rl.words.verdict import unlike as say_unlike


@dataclasses.dataclass(frozen=True)
class Evaluation:
    """How good a policy is, and luck and the oracle beside it, in the same worlds."""

    policy: Pilot
    settings: EvaluateSettings
    flown: dict[str, dict[str, Any]]
    """Figures of all that was flown, by name, see `drone_rl.evaluation.summarise`: "greedy",
    "sampled" and the baselines."""
    seed: RootSeed
    """Root of the environments' random streams."""
    rounding: dict[str, Any] | None = None
    """What computed the actions, and whether another implementation takes the same ones in the
    first episodes, see `drone_rl.evaluation.fragility.Rounding`."""

    @property
    def success(self) -> float:
        """Share of greedy episodes in which all was collected."""
        return self.flown["greedy"]["success"]["share"]

    def rows(self) -> list[list[str]]:
        """The figures side by side, as texts: names, then a row for each figure."""
        flown = self.flown.values()
        rows = [["", *self.flown]]
        terms = as_task(self.policy.task).terms
        rows.append([f"all {terms.goals}", *(interval(f["success"], "share") for f in flown)])
        rows.append([f"mean {terms.goals}", *(f"{f['mean_goals']:.3f}" for f in flown)])
        for name in self.flown["greedy"]["shares"]:
            cells = (interval(f["shares"][name], "mean") for f in flown)
            rows.append([f"share {name}", *cells])
        rows.append(["never reached", *(f"{f['never_reached']['mean']:.3f}" for f in flown)])
        for reason in self.flown["greedy"]["ends"]:
            cells = (str(f["ends"][reason]["successes"]) for f in flown)
            rows.append([f"ended: {reason.replace('_', ' ')}", *cells])
        rows.append(["mean length", *(f"{f['mean_length']:.1f}" for f in flown)])
        rows.append(["episodes", *(str(f["episodes"]) for f in flown)])
        return rows

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as in `evaluation.json`."""
        origin = self.policy.origin
        return {
            "policy": origin["policy"],
            **self.seed.as_dict(),
            **({"unlike": self.policy.unlike} if self.policy.unlike else {}),
            **self.flown,
            "rounding": self.rounding,
            **provenance(),
            "trained": origin["trained"] and origin["trained"]["progress"],
        }

    def __str__(self) -> str:
        """The table for a terminal, and the lines below it."""
        return "\n".join([aligned(self.rows(), are_numbers=True), *self._notes()])

    def _repr_html_(self) -> str:
        head, *rows = self.rows()
        return table(head, rows) + "".join(map(paragraph, self._notes()))

    def _notes(self) -> list[str]:
        """The arithmetic, the seed and, in other dynamics than its own, what differs."""
        unlike, seed = self.policy.unlike, self.seed.as_dict()
        evidence = {**seed, "rounding": self.rounding}
        said = [say(EVALUATION, evidence), say_unlike({"unlike": unlike}) if unlike else ""]
        return [*filter(None, said), seed_line(seed)]


@dataclasses.dataclass(frozen=True)
class Judgement:
    """A verdict, of whom, and by what."""

    name: str
    settings: JudgeSettings
    verdict: Verdict
    certificate: Path | None = None
    """That lies with the policy or was given, whether it is quoted or not."""
    measured: Measured | None = None
    """Its flights under other conditions, if there are any."""
    coverage: Coverage | None = None
    """What was required beside its operating domain, if something was."""

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as in `verdict.json`."""
        path = None if self.certificate is None else str(self.certificate)
        return {
            "policy": self.name,
            "certificate": path,
            "shifts": None if self.measured is None else str(self.measured.path),
            "domain": self.domain or None,
            "required_domain": None if self.coverage is None else self.coverage.as_dict(),
            **self.verdict.as_dict(),
            **provenance(),
        }

    @property
    def domain(self) -> str:
        """Under which conditions it is good, for a person; nothing if that was not measured."""
        return "" if self.measured is None else sentence(_told(self.measured, self.verdict))

    def status(self, require: str | None = None) -> int:
        """The exit status of `drone-rl verdict`: the verdict's own, or that of what is required.

        Args:
            require: "proved" for a re-checked proof of every placement, "good" or None for the
                verdict's own; a domain that was required has to be covered, too.
        """
        if require == "proved" and not self.verdict.is_proved:
            return NOT_PROVED
        if self.coverage is not None and not self.coverage.is_covered:
            return NOT_COVERED
        is_proof_enough = require == "proved" and self.coverage is None
        return 0 if is_proof_enough else self.verdict.exit_code

    def save(self, path: Path) -> None:
        """Writes `verdict.json`."""
        path.write_text(json.dumps(self.as_dict(), indent=2))

    def __str__(self) -> str:
        """One line, and others of an operating domain, of what it does not cover, and the seed."""
        certainty = "" if self.verdict.certain else " (not certain)"
        line = f"{self.verdict.kind.value}{certainty}: {self.verdict.sentence}"
        required = "" if self.coverage is None else str(self.coverage)
        seed = seed_line(self.verdict.evidence)
        return "\n".join(filter(None, (line, self.domain, required, seed)))

    def _repr_html_(self) -> str:
        evidence = self.verdict.evidence
        numbers = [
            [quantity_label(name, evidence), *(_number(q[key]) for key in _ENDS)]
            for name, q in evidence["quantities"].items()
        ]
        success = evidence["greedy"]["success"]
        rate = [_number(success[key]) for key in ("share", "lower95", "upper95")]
        head = ["quantity", "value", "lower", "upper"]
        lines = "".join(paragraph(line) for line in str(self).splitlines())
        return lines + table(head, [["success rate (95% interval)", *rate], *numbers])


_ENDS = ("value", "lower", "upper")


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def evaluate(
    policy: str | Path | Pilot | Logits,
    settings: EvaluateSettings | None = None,
    *,
    progress: Progress | None = None,
    **changes: Any,
) -> Evaluation:
    """Flies a policy, greedily and with drawn actions, and the baselines, in unseen worlds.

    Args:
        policy: The policy, what `load_policy` takes, or a callable, see `policy_from`.
        settings: How.
        progress: Told of what is being flown; a bar by default.
        changes: Settings to change, as in `evaluate("good", episodes=200)`.

    Raises:
        InputError: The policy or a setting is unusable.
    """
    settings, seed = with_seed((settings or EvaluateSettings()).replace(**changes))
    progress = progress or Bar()
    policy = as_pilot(policy)
    episodes, steps = settings.episodes, 3 if settings.baselines else 2
    with _flying(policy, settings, seed) as (env, actor):
        worlds, dynamics = env.base_env.state_dict(), worlds_of(env).dynamics
        progress("most probable actions", 0, steps)
        log = StepLog()
        flown = {"greedy": run_episodes(env, actor, episodes, log=log)}
        env.base_env.load_state_dict(worlds)
        rounding = compare(env, actor, flown=flown["greedy"], log=log)
        env.base_env.load_state_dict(worlds)
        progress("drawn actions", 1, steps)
        flown["sampled"] = run_episodes(env, actor, episodes, greedy=False)
    if settings.baselines:
        progress("luck and the oracle", 2, steps)
        num_worlds, device = settings.num_worlds, settings.device
        flown |= fly_baselines(num_worlds, policy.task, worlds, episodes, device, dynamics)
    progress("evaluated", steps, steps)
    figures = {name: summarise(e) for name, e in flown.items()}
    return Evaluation(policy, settings, figures, seed, rounding and rounding.as_dict())


@overload
def judge(
    policy: str | Path | Pilot | Logits, settings: JudgeSettings | None = None, **how: Any
) -> Judgement: ...


@overload
def judge(
    policy: Sequence[str | Path | Pilot | Logits],
    settings: JudgeSettings | None = None,
    **how: Any,
) -> Judgements[Judgement]: ...


def judge(
    policy: str | Path | Pilot | Logits | Sequence[str | Path | Pilot | Logits],
    settings: JudgeSettings | None = None,
    **how: Any,
) -> Judgement | Judgements[Judgement]:
    """Judge one policy, or several one after the other; see `judge_one` for the arguments.

    Args:
        policy: As `judge_one` takes it; of a list or tuple each is judged.
        settings: How.
        how: The other arguments of `judge_one`.

    Returns:
        The judgement, or one for each policy of the list.

    Raises:
        InputError: See `judge_one`, or the list is empty.
    """
    if not isinstance(policy, list | tuple):
        return judge_one(cast("Any", policy), settings, **how)
    if not policy:
        raise InputError("policy=[] names nobody; give one or more policies")
    for one in policy:  # a wrong one is refused before any episode
        if one not in BASELINES:
            as_pilot(one, how.get("outputs", "outputs"))
    given = how.pop("seed", (settings or JudgeSettings()).seed)
    seed = how.pop("drawn_seed", None) or root_seed(given)  # all in the same environments
    done = (judge_one(one, settings, drawn_seed=seed, **how) for one in policy)
    return Judgements(tuple(done))


def judge_one(
    policy: str | Path | Pilot | Logits,
    settings: JudgeSettings | None = None,
    *,
    task: Mapping[str, Any] | None = None,
    dynamics: Mapping[str, Any] | None = None,
    certificate: str | Path | None = None,
    shifts: str | Path | None = None,
    require_domain: str | Path | None = None,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    drawn_seed: RootSeed | None = None,
    **changes: Any,
) -> Judgement:
    """Good, poor, one-sided or none of these, and whether that is certain.

    Args:
        policy: The policy, what `load_policy` takes, a callable, see `policy_from`, a model of
            Stable-Baselines3, or a baseline: "random", "forward", "left", "right" or "oracle".
        settings: How it is judged.
        task: What to change of the policy's task or, for a baseline, of the default one.
        dynamics: What to change of how its drone moves, likewise.
        certificate: A proof's file to quote; by default the one that lies with the policy, see
            `drone_rl.zoo.certificate_path`, if it is of this task.
        shifts: A file of its flights under other conditions to quote; by default what lies with the
            policy or the newest under `outputs`, see `drone_rl.api.domains.find_domain`.
        require_domain: A file that says under which conditions it has to be good, see
            `drone_rl.conditions.needs.read_needs`.
        outputs: Folder under which runs are kept.
        progress: Told of what is being done; a bar by default.
        drawn_seed: The seed of a larger analysis of which this is a part; that of the settings by
            default.
        changes: Settings to change, as in `judge("good", episodes=1000)`.

    Raises:
        InputError: The policy, a setting or a file that is given is unusable, or a domain is
            required of whom none was measured.
    """
    settings, seed = with_seed((settings or JudgeSettings()).replace(**changes), drawn_seed)
    progress = progress or Bar()
    progress("policy, luck and oracle", 0, 1)
    pilot = None if policy in BASELINES else as_pilot(policy, outputs)
    name = str(policy) if pilot is None or isinstance(policy, str | Path) else pilot.name
    claim = measured = coverage = None
    if pilot is None:
        _refuse_files(name, certificate=certificate, shifts=shifts, require_domain=require_domain)
    if pilot is None:
        changed = Changes(TaskSettings).read(task or {}, "task")
        moved = DynamicsSettings(**Changes(DynamicsSettings).read(dynamics or {}, "dynamics"))
        moved.check_air()
        worlds = _baseline(name, TaskSettings(**changed), moved, settings, seed)
    else:
        pilot = pilot.in_task(**(task or {}))
        pilot = pilot.in_dynamics(**dynamics) if dynamics else pilot
        measured = find_domain(pilot, shifts, outputs)
        coverage = require(pilot, require_domain, measured) if require_domain is not None else None
        coverage = _reflown(pilot, coverage, measured, settings, seed)
        claim = find_claim(
            pilot,
            certificate,
            flights=settings.certificate_flights,
            seed=seed,
            device=settings.device,
            renderer=settings.renderer,
        )
        worlds = _flying(pilot, settings, seed)
    draws, rule = settings.sampled and pilot is not None, Rule(good_share=settings.good_share)
    with worlds as (env, actor):
        verdict = judge_policy(
            env,
            actor,
            settings.episodes,
            rule=rule,
            sampled=draws,
            claim=claim,
            unlike=None if pilot is None else pilot.unlike,
            seed=seed,
        )
    progress("judged", 1, 1)
    done = Judgement(name, settings, verdict, claim and claim.path, measured)
    if coverage is None or measured is None:
        return done
    return dataclasses.replace(done, coverage=beside(coverage, _told(measured, verdict)))


def _reflown(
    pilot: Pilot,
    coverage: Coverage | None,
    measured: Measured | None,
    settings: JudgeSettings,
    seed: RootSeed,
) -> Coverage | None:
    """The same with new episodes, if there is a claim for them to check."""
    numbers = None if measured is None else measured.numbers
    if coverage is None or numbers is None or not coverage.is_stated or not settings.domain_flights:
        return coverage
    reflown = refly(pilot, coverage.needs, numbers, settings, seed)
    return dataclasses.replace(coverage, reflown=reflown)


def _told(measured: Measured, verdict: Verdict) -> dict[str, Any]:
    """Evidence of what may be quoted."""
    return {"shifts": measured.evidence, "verdict": verdict.evidence}


def _refuse_files(name: str, **given: str | Path | None) -> None:
    """A baseline has no network that a file could be of."""
    for setting, path in given.items():
        if path is not None:
            raise InputError(
                f"{setting}={path}, but policy={name} has no network; give {setting}= with the "
                "policy that it is of"
            )


def _flying(
    policy: Pilot, settings: FlightSettings, seed: RootSeed
) -> AbstractContextManager[tuple[Any, TensorDictModuleBase]]:
    """Unseen worlds and the policy in them."""
    return policy.flying(
        settings.num_worlds,
        seed=seed.value,
        device=settings.device,
        renderer=settings.renderer,
    )


@contextmanager
def _baseline(
    name: str,
    task: TaskSettings,
    dynamics: DynamicsSettings,
    settings: FlightSettings,
    seed: RootSeed,
) -> Iterator[tuple[EnvBase, TensorDictModuleBase]]:
    """The same worlds and one that sees no picture."""
    env = DroneEnv(
        settings.num_worlds,
        task,
        seed=seed.value,
        stream=Stream.REPORT,
        pixels=False,
        device=settings.device,
        dynamics=dynamics,
    )
    generator = torch_generator(seed.value, Stream.ACTIONS, device=env.device)
    try:
        yield env, make_baseline(name, task, generator, env.worlds.dynamics.actions)
    finally:
        env.close()
