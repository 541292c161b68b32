"""Evaluations of policies, as objects that show themselves."""

import dataclasses
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from tensordict.nn import TensorDictModuleBase

from drone_rl.config.judging import EvaluateSettings, FlightSettings
from drone_rl.envs import worlds_of
from drone_rl.evaluation.baselines import fly_baselines
from drone_rl.evaluation.metrics import summarise
from drone_rl.evaluation.rollouts import StepLog, run_episodes
from drone_rl.evaluation.rounding_sensitivity import compare
from drone_rl.evaluation.verdict_text import unlike as say_unlike
from drone_rl.policies.base_policy import Pilot
from drone_rl.policies.external_network import Logits
from drone_rl.policies.external_policy import as_pilot
from drone_rl.sim.tasks import as_task
from drone_rl.utils.display import aligned, interval, paragraph, table
from drone_rl.utils.progress import Bar, Progress
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seed_text import fixed_seed, seed_line
from drone_rl.utils.seeding import RootSeed, with_seed
from drone_rl.utils.sentences import Evidence, Sentence, percent, say


def _computed(evidence: Evidence) -> str:
    return f"Computed in {evidence['rounding']['arithmetic']}."


def _counts(evidence: Evidence) -> str:
    found = evidence["rounding"]
    return f"{found['differing']:,} of the first {found['compared_episodes']:,} greedy episodes"


def _same(evidence: Evidence) -> str:
    found = evidence["rounding"]
    return (
        f"The same actions in all of the first {found['compared_episodes']:,} greedy episodes "
        f"when computed again ({found['compared']})."
    )


def _other(evidence: Evidence) -> str:
    found = evidence["rounding"]
    return (
        f"Other actions in {_counts(evidence)} when computed again ({found['compared']}): "
        "decisions depend on rounding."
    )


def _is_fragile(evidence: Evidence) -> bool:
    found = evidence.get("rounding")
    return bool(found) and bool(found.get("excessive")) and found["fragile"] > 0


def _fragile(evidence: Evidence) -> str:
    found = evidence["rounding"]
    return (
        f"These figures hold for this arithmetic only: in {found['fragile']:,} of "
        f"{found['frames']:,} of these episodes' frames ({percent(found['fragile_rate'])}) the "
        "order in which float32 sums are computed can change the action."
    )


EVALUATION = (
    fixed_seed("evaluation.fixed_seed"),
    Sentence(
        "computed",
        "it is known what computed the actions",
        lambda e: bool(e.get("rounding")),
        _computed,
    ),
    Sentence(
        "computed.same",
        "another implementation took the same actions",
        lambda e: bool(e.get("rounding")) and not e["rounding"]["differing"],
        _same,
    ),
    Sentence(
        "computed.other",
        "another implementation took other actions",
        lambda e: bool(e.get("rounding")) and e["rounding"]["differing"] > 0,
        _other,
    ),
    Sentence(
        "computed.fragile",
        "rounding can change the action in more frames or episodes than a verdict allows",
        _is_fragile,
        _fragile,
    ),
)


@dataclasses.dataclass(frozen=True)
class Evaluation:
    """How good a policy is, and luck and the oracle beside it, in the same worlds."""

    policy: Pilot
    settings: EvaluateSettings
    flown: dict[str, dict[str, Any]]
    """Figures by name, see `drone_rl.evaluation.metrics.summarise`: "greedy",
    "sampled" and the baselines."""
    seed: RootSeed
    """Root of the environments' random streams."""
    rounding: dict[str, Any] | None = None
    """What computed the actions, and whether another implementation takes the same ones in the
    first episodes, see `drone_rl.evaluation.rounding_sensitivity.Rounding`."""

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
    with held_out(policy, settings, seed) as (env, actor):
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


def held_out(
    policy: Pilot, settings: FlightSettings, seed: RootSeed
) -> AbstractContextManager[tuple[Any, TensorDictModuleBase]]:
    """Unseen worlds and the policy in them."""
    return policy.flying(
        settings.num_worlds,
        seed=seed.value,
        device=settings.device,
        renderer=settings.renderer,
    )
