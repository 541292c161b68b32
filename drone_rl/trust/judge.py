"""`drone-rl verdict`: judge policies and baselines, with certificate and operating domain."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, cast, overload

from torchrl.envs import EnvBase

from drone_rl.config import AppearanceSettings, BaseTaskSettings, DynamicsSettings
from drone_rl.config.commands import HeldOutSettings, JudgeSettings
from drone_rl.config.configuration import Changes, as_changes, changed, from_arguments
from drone_rl.envs import DroneEnv
from drone_rl.envs.rollout import Agent
from drone_rl.policies.baselines import make_baseline
from drone_rl.policies.external_network import Logits
from drone_rl.policies.external_policy import as_policy
from drone_rl.policies.policy import BasePolicy, Policy
from drone_rl.policies.zoo import fingerprint
from drone_rl.sim.tasks import Task, as_task
from drone_rl.trust.baselines import BASELINES
from drone_rl.trust.coverage import check_required, find_domain
from drone_rl.trust.evaluate import held_out_environments
from drone_rl.trust.findings import Finding
from drone_rl.trust.results import Proof, Verdict
from drone_rl.trust.rule import Rule
from drone_rl.trust.shifts_results import Coverage, SavedShifts, find
from drone_rl.trust.verdict import FindClaim, judge_policy
from drone_rl.utils.display import Result, TableResult, paragraph
from drone_rl.utils.errors import InputError
from drone_rl.utils.exit_codes import NOT_COVERED, PROOF_MISSING
from drone_rl.utils.progress import Progress, as_progress
from drone_rl.utils.provenance import Provenance, provenance
from drone_rl.utils.schema import Instance
from drone_rl.utils.seeding import RootSeed, Stream, root_seed, torch_generator, with_seed
from drone_rl.utils.text import rate


class Judgement(Result, Verdict, Provenance):
    """A verdict on a policy, with certificate and operating domain; as in `verdict.json`."""

    policy: str
    """Its name."""
    weights: str | None = None
    """Hash of the policy's weights if it was judged in the conditions of its training."""
    certificate: str | None = None
    """The given file or that next to the policy, even if the verdict does not quote it."""
    shifts: str | None = None
    """File of its robustness evaluation, if there is one."""
    findings: tuple[Finding, ...] = ()
    """What its success depends on, the largest effect first."""
    required_domain: Coverage | None = None
    """The test of the required operating domain, if one is required."""

    @property
    def verdict(self) -> Verdict:
        """The verdict: this result, which adds files and the operating domain to it."""
        return self

    def status(self, require: str | None = None) -> int:
        """Return the exit code of `drone-rl verdict`.

        Args:
            require: "proved" also requires a proof of every placement that was computed here (see
                `judge`), as a required domain has to be covered.
        """
        if require == "proved" and not self.is_proved:
            return PROOF_MISSING
        if self.required_domain is not None and not self.required_domain.is_covered:
            return NOT_COVERED
        return self.exit_code

    def save(self, path: Path) -> None:
        """Write `verdict.json`."""
        self.replace(**provenance()).write_json(path)

    def __str__(self) -> str:
        """Return the verdict, its findings, what a required domain lacks, and the seed."""
        required = [] if self.required_domain is None else [str(self.required_domain)]
        texts = [finding.text for finding in self.findings]
        return "\n".join([self.line, *texts, *required, self.seed_line()])

    def _repr_html_(self) -> str:
        return "".join(map(paragraph, str(self).splitlines()))


class Judgements(TableResult, tuple[Judgement, ...]):
    """Several judgements, in the order of the policies."""

    __slots__ = ()

    def rows(self) -> list[list[str]]:
        """Return a table of texts: a heading, then a row for each policy."""
        rows = [["policy", "verdict", "certain", "success rate (95% CI)"]]
        for one in self:
            certain, success = "yes" if one.certain else "no", rate(one.greedy.success, label="")
            rows.append([one.policy, one.kind.value, certain, success])
        return rows


Given = str | Path | BasePolicy | Logits
"""A policy, or something that `as_policy` converts to one."""


@overload
def judge(policy: Given, settings: JudgeSettings | None = None, **options: Any) -> Judgement: ...


@overload
def judge(
    policy: Sequence[Given],
    settings: JudgeSettings | None = None,
    **options: Any,
) -> Judgements: ...


def judge(
    policy: Given | Sequence[Given],
    settings: JudgeSettings | None = None,
    **options: Any,
) -> Judgement | Judgements:
    """Judge one policy, or a list or tuple of policies in the same environments.

    Args:
        policy: The policy, what `load_policy` takes, a callable, see `policy_from`, a model of
            Stable-Baselines3, or a baseline: "random", "forward", "left", "right" or "oracle".
        settings: Number of episodes, seed, device and so on.
        options: See `drone_rl.trust.judge.judge_one`; also settings to change, as in
            `judge("good", episodes=1000, appearance="fog")`.

    Raises:
        InputError: A policy, setting or file is unusable, or the list is empty.
    """
    if not isinstance(policy, list | tuple):
        return judge_one(cast("Any", policy), settings, **options)
    if not policy:
        raise InputError("policy=[] is empty; give one or more policies")
    settings = from_arguments(JudgeSettings, settings, {}, judge_one)
    changed = {name: options.get(name) for name in ("task", "dynamics", "appearance")}
    for one in policy:  # a wrong one is refused before any episode
        _loaded(one, options.get("outputs", "outputs"), changed)
    seed = options.pop("seed", settings.seed)  # all in the same environments
    options["drawn_seed"] = options.get("drawn_seed") or root_seed(seed)
    return Judgements(tuple(judge_one(one, settings, **options) for one in policy))


def judge_one(
    policy: Given,
    settings: JudgeSettings | None = None,
    *,
    task: Mapping[str, Any] | BaseTaskSettings | Task[Any] | str | None = None,
    dynamics: Mapping[str, Any] | None = None,
    appearance: AppearanceSettings | str | None = None,
    certificate: str | Path | None = None,
    shifts: str | Path | None = None,
    require_domain: str | Path | None = None,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    drawn_seed: RootSeed | None = None,
    find_claim: FindClaim | None = None,
    require: str | None = None,
    **changes: Any,
) -> Judgement:
    """Judge the kind of a policy, see `drone_rl.trust.rule`, and whether it is certain.

    Args:
        policy: The policy, what `load_policy` takes, a callable, see `policy_from`, a model of
            Stable-Baselines3, or a baseline: "random", "forward", "left", "right" or "oracle".
        settings: Number of episodes, seed, device and so on.
        task: Settings to change of the policy's task. For a baseline, its task: a name, settings,
            or settings to change of the default one or of that with the name in "name".
        dynamics: Settings to change of the dynamics, likewise.
        appearance: Appearance of the scenes, or the name of one such as "fog"; by default that of
            the policy's training.
        certificate: Certificate to quote, passed to `find_claim`.
        shifts: Robustness evaluation to quote, see `drone_rl.trust.coverage.find_domain`.
        require_domain: File of the required domain, see
            `drone_rl.trust.coverage.read_requirements`.
        outputs: Folder of all runs.
        progress: Called with what is running; a progress bar by default.
        drawn_seed: Seed of a larger analysis of which this is a part.
        find_claim: Finds and checks certificates; by default none is quoted. `drone_rl.judge`
            passes `drone_rl.verification.claim.find_claim`.
        require: "proved" computes the proof again if a certificate states success from every
            placement (minutes); without this no policy counts as proved, since files can be forged.
        changes: Settings to change, as in `judge("good", episodes=1000)`.

    Raises:
        InputError: A policy, setting or file is unusable.
    """
    settings = from_arguments(JudgeSettings, settings, changes, judge_one)
    settings, seed = with_seed(settings, drawn_seed)
    progress = as_progress(progress)
    require = Instance(Literal["good", "proved"] | None).read(require, "require")
    changed = {"task": task, "dynamics": dynamics, "appearance": appearance}
    loaded = _loaded(policy, outputs, changed)
    name = str(policy) if loaded is None or isinstance(policy, str | Path) else loaded.name
    if isinstance(loaded, Policy) and policy == "latest":  # which changes with the next run
        name = str(loaded.path)
    claim: Proof | None = None
    measured: SavedShifts | None = None
    coverage: Coverage | None = None
    if loaded is None:
        files = {"certificate": certificate, "shifts": shifts, "require_domain": require_domain}
        for setting, path in files.items():
            if path is not None:
                raise InputError(
                    f"{setting}={path}, but policy={name} has no network; give {setting}= with the "
                    "policy that it is of"
                )
        changes = Changes(DynamicsSettings).read(as_changes(dynamics, "dynamics"), "dynamics")
        drone = DynamicsSettings.read(changes, "dynamics")
        drone.check_air()
        worlds = _baseline(name, _task_of(task), drone, settings, seed)
    else:
        measured = find_domain(loaded, shifts, outputs)
        if require_domain is not None:
            coverage = check_required(loaded, require_domain, settings, seed)
        where = {"device": settings.device, "renderer": settings.renderer}
        flights = settings.certificate_flights
        if find_claim is not None:
            claim = find_claim(
                loaded,
                certificate,
                flights=flights,
                prove_again=require == "proved",
                seed=seed,
                progress=progress,
                **where,
            )
        worlds = held_out_environments(loaded, settings, seed)
    with worlds as (env, actor):
        verdict = judge_policy(
            env,
            actor,
            settings.episodes,
            sampled=settings.sampled and loaded is not None,
            rule=Rule(good_share=settings.good_share),
            claim=claim,
            unlike=None if loaded is None else loaded.unlike,
            known_scenes=() if loaded is None else loaded.known_scenes,
            seed=seed,
            progress=progress,
        )
    return Judgement(
        **dict(verdict),
        policy=name,
        weights=identify(loaded),
        certificate=None if claim is None else claim.path,
        shifts=None if measured is None else measured.path,
        findings=find(verdict, measured),
        required_domain=coverage,
    )


def identify(policy: BasePolicy | None) -> str | None:
    """Return the hash of a policy's weights, None if its conditions are not those of training."""
    if not isinstance(policy, Policy):
        return None
    if policy.description != policy.state.description:
        return None
    return fingerprint(policy.state.weights)


def _loaded(policy: Any, outputs: str | Path, changed: Mapping[str, Any]) -> BasePolicy | None:
    """Return a policy with its changes; None for a baseline, which sees no images."""
    if not (isinstance(policy, str) and policy in BASELINES):
        return as_policy(policy, outputs, **changed)
    if changed["appearance"] is not None:
        raise InputError(f"policy={policy} sees no images; leave appearance out")
    return None


def _task_of(given: Any) -> Task[Any]:
    """Return a task, by its name or settings, or with changes of the default one's."""
    if given is None or isinstance(given, str | BaseTaskSettings | Task):
        return as_task(given)
    changes = Changes().read(as_changes(given, "task"), "task")
    named = {name: value for name, value in changes.items() if name == "name"}
    return as_task(changed(BaseTaskSettings.read(named, "task"), changes, {}, "task"))


@contextmanager
def _baseline(
    name: str,
    task: Task[Any],
    dynamics: DynamicsSettings,
    settings: HeldOutSettings,
    seed: RootSeed,
) -> Iterator[tuple[EnvBase, Agent]]:
    """Environments without images, and a baseline."""
    env = DroneEnv(
        settings.batch_size,
        task,
        seed=seed.value,
        stream=Stream.REPORT,
        pixels=False,
        device=settings.device,
        dynamics=dynamics,
    )
    generator = torch_generator(seed.value, Stream.ACTIONS, device=env.device)
    try:
        yield env, make_baseline(name, env.worlds.task, env.worlds.dynamics.actions, generator)
    finally:
        env.close()
