"""Evaluate a policy with software in the loop: Betaflight between actions and rotors."""

import contextlib
import tempfile
import time
from pathlib import Path
from typing import Any

import torch

from drone_rl.collectors.complete_episodes import CompleteEpisodes
from drone_rl.envs import base_env
from drone_rl.envs.rollout import ActorAgent, StepContext, steps
from drone_rl.flight.betaflight.build import find_firmware
from drone_rl.flight.betaflight.sitl import Betaflight, betaflight_drone
from drone_rl.flight.in_the_loop.drone import FlightControllerError, NotReadyError
from drone_rl.flight.in_the_loop.dynamics import InTheLoopDynamics
from drone_rl.policies.actor import exploring
from drone_rl.policies.external_network import Logits
from drone_rl.policies.external_policy import as_policy
from drone_rl.policies.policy import BasePolicy
from drone_rl.trust.metrics import summarise
from drone_rl.trust.results import Figures
from drone_rl.utils.display import Result
from drone_rl.utils.errors import InputError
from drone_rl.utils.models import Seeded, Stored
from drone_rl.utils.progress import Progress, as_progress, silent
from drone_rl.utils.schema import Whole
from drone_rl.utils.seeding import RootSeed, root_seed
from drone_rl.utils.text import interval

STARTS = 3
"""Attempts to start a firmware for one episode."""


class SitlEpisode(Stored):
    """One episode with software in the loop."""

    world: int
    """Number of the environment, as in evaluations."""
    goals: int
    """Number of goals reached."""
    success: bool
    """Whether it ended with success."""
    end: str
    """Name of one of the task's ends."""
    steps: int
    simulated_s: float
    """Simulated seconds from the first action to the end."""
    wall_s: float
    """Wall-clock seconds, arming and take-off included."""
    missed: int
    """Ticks that the firmware did not answer in time."""
    path: tuple[tuple[float, ...], ...]
    """Positions before the first action and after each, metres, world frame."""


class SitlEvaluation(Result, Figures, Seeded):
    """Episodes of a policy with software in the loop, and their figures."""

    policy: str
    flights: tuple[SitlEpisode, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return plain values: the figures and each episode."""
        return self.model_dump(mode="json")

    def __str__(self) -> str:
        """Return a line per episode and a summary."""
        lines = [
            f"environment {f.world}: {f.goals} reached, {f.end.replace('_', ' ')}, "
            f"{f.steps} steps, {f.simulated_s:.1f} s"
            for f in self.flights
        ]
        success = self.success
        share = f"{success.successes} of {success.trials} succeeded (95% CI {interval(success)})"
        return "\n".join([*lines, *filter(None, [share, self.seed_warning(), self.seed_line()])])


def evaluate_in_the_loop(
    policy: str | Path | BasePolicy | Logits,
    flights: int = 5,
    seed: int | None = None,
    *,
    firmware: str | Path | None = None,
    isolated: bool = True,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    drawn_seed: RootSeed | None = None,
) -> SitlEvaluation:
    """Run a greedy policy with Betaflight between its actions and the rotors.

    Initial states are the first ones of evaluations with the same seed. Each episode starts a new
    firmware process, which arms, takes off and hovers where the episode begins.

    Args:
        policy: What `judge` takes. In computer-vision mode it flies AirSim's drone.
        flights: Number of episodes, each in about real time at best.
        seed: Root of the environments' random streams; a fresh one by default.
        firmware: See `drone_rl.flight.betaflight.build.find_firmware`.
        isolated: See `drone_rl.flight.betaflight.sitl.betaflight_drone`.
        outputs: See `load_policy`.
        progress: Called with what is running; a progress bar by default.
        drawn_seed: Seed of a larger analysis of which this is a part; takes precedence.

    Raises:
        InputError: The policy or a number is unusable, or no firmware was built.
        FlightControllerError: The firmware failed, or the machine was too busy for it.
    """
    Whole(1).read(flights, "flights")
    progress, loaded = as_progress(progress), as_policy(policy, outputs)
    root = drawn_seed or root_seed(seed)
    program = find_firmware(firmware)
    results: list[tuple[CompleteEpisodes, SitlEpisode]] = []
    with tempfile.TemporaryDirectory(prefix="betaflight-") as folder:
        for world in range(flights):
            progress(f"{loaded.name}: software in the loop", world, flights)
            results.append(
                _fly_or_restart(loaded, world, root.value, program, Path(folder), isolated)
            )
    progress("flown", flights, flights)
    ended, episodes = zip(*results, strict=True)
    figures = summarise(CompleteEpisodes.joined(ended))
    return SitlEvaluation(**dict(figures), **root.as_dict(), policy=loaded.name, flights=episodes)


def figures_in_the_loop(policy: BasePolicy, flights: int, seed: RootSeed) -> SitlEvaluation:
    """Return the evaluation; if there are no episodes, an `InputError` has the reason."""
    try:
        return evaluate_in_the_loop(policy, flights, drawn_seed=seed, progress=silent)
    except FlightControllerError as error:
        raise InputError(str(error)) from error


def _fly_or_restart(
    policy: BasePolicy, world: int, *args: Any
) -> tuple[CompleteEpisodes, SitlEpisode]:
    """Run one episode; restart a firmware that fails before the policy acts."""
    for _ in range(STARTS - 1):
        with contextlib.suppress(NotReadyError):
            return _fly(policy, world, *args)
    return _fly(policy, world, *args)


@torch.no_grad()
def _fly(
    policy: BasePolicy, world: int, seed: int, program: Path, folder: Path, isolated: bool
) -> tuple[CompleteEpisodes, SitlEpisode]:
    """Run one episode with a new firmware process."""
    began = time.monotonic()
    settings = policy.dynamics.replace(mode="simple_flight")
    with contextlib.ExitStack() as stack:
        stack.enter_context(exploring(greedy=True))
        drone = stack.enter_context(
            betaflight_drone(settings, firmware=program, folder=folder, isolated=isolated)
        )
        dynamics = InTheLoopDynamics(drone, settings, policy.actions)
        env, actor = stack.enter_context(
            policy.flying(1, seed=seed, first_world=world, dynamics=dynamics)
        )
        base = base_env(env)
        state, worlds = base.start(), base.worlds
        first = StepContext(base.observer, state, torch.tensor([0]), torch.tensor([True]))
        ActorAgent(actor).act(first)  # once before the firmware waits for it
        dynamics.begin(state.body)
        start, path = drone.time, [drone.body.position[0].tolist()]
        for step in steps(ActorAgent(actor), base.observer, state):
            state = step.after
            path.append(drone.body.position[0].tolist())
        count = len(path) - 1
        ended = CompleteEpisodes.ended(worlds.task, worlds.info(state), torch.tensor([count]))
        reached = ended.goals.reached[0]
        return ended, SitlEpisode(
            world=world,
            goals=int(reached.sum()),
            success=bool(ended.success[0]),
            end=worlds.task.ends(int(ended.end_reason[0])).name.lower(),
            steps=count,
            simulated_s=drone.time - start,
            wall_s=time.monotonic() - began,
            missed=drone.controller.missed if isinstance(drone.controller, Betaflight) else 0,
            path=tuple(map(tuple, path)),
        )
