"""`drone-rl prove`, `check`, `places` and `chain`: their settings."""

import logging
from pathlib import Path
from typing import Annotated

import pydantic

import drone_rl
from drone_rl.cli.settings import CommandSettings, PolicyCommandSettings, finish
from drone_rl.config.commands import ChanceSettings, CheckSettings, PlacesSettings, ProveSettings
from drone_rl.config.configuration import TaskChanges
from drone_rl.utils.exit_codes import NOT_PROVED
from drone_rl.utils.progress import bar_or_lines, log
from drone_rl.utils.schema import Real, Several

_log = logging.getLogger(__name__)


class ProveCommand(PolicyCommandSettings, ProveSettings):
    """Verify the greedy policy exhaustively over all cube placements.

    Exit status: 0 it collects all cubes from every placement, 15 it fails or is undecided for
    some.
    """

    def run(self, folder: Path) -> tuple[int, float]:
        """Verify a policy; return the exit status and the fraction of placements with success."""
        settings = self.as_base(ProveSettings)
        proof = drone_rl.prove(self.policy, settings, folder=folder, **self.shared())
        print(proof)
        _log.info("written: %s", folder / "certificate.json")
        if proof.certificate.found.stopped_by == "limit_s":
            _log.info("resume with the same command and hydra.run.dir=%s", folder)
        return 0 if proof.is_proved else NOT_PROVED, proof.success


class CheckCommand(CommandSettings, CheckSettings):
    """Check a certificate independently of the prover.

    Exit status: 0 no sum and no simulated episode refutes it, 14 it is refused.
    """

    certificate: str = "latest"
    """Certificate: a file of drone-rl prove, or latest for the newest one."""
    policy: str | None = None
    """Policy of the certificate, as a file, the folder of a run, latest, or a shipped policy's
    name; null takes the shipped policy that the certificate names."""
    task: TaskChanges = pydantic.Field(default_factory=dict)
    """Settings that the certificate's task must have, as in task.num_cubes=5; by default any."""

    def run(self, folder: Path) -> tuple[int, bool]:
        """Check a certificate; return the exit status and whether it is accepted."""
        result = drone_rl.check(
            self.certificate,
            self.policy,
            self.as_base(CheckSettings),
            task=self.task,
            outputs=self.paths.outputs,
            progress=bar_or_lines(),
        )
        finish(result, folder / "check.json")
        return result.exit_code, result.accepted


class PlacesCommand(PolicyCommandSettings, PlacesSettings):
    """Map the greedy action for every position of one cube, exactly.

    Writes JSON, PNG and SVG.
    """

    def run(self, folder: Path) -> tuple[int, float]:
        """Map actions by cube position; return the exit status and the blind fraction of places."""
        settings = self.as_base(PlacesSettings)
        result = drone_rl.places(self.policy, settings, **self.shared(), progress=log)
        finish(result, folder, "places.json, places.png and places.svg")
        return 0, result.blind


class ChainCommand(PolicyCommandSettings, ChanceSettings):
    """Compute the exact probability of each outcome of an episode with sampled actions.

    The episode is a Markov chain over the drone's possible positions.
    """

    cubes: Annotated[tuple[float, ...], Several(Real(-10_000.0, 10_000.0, unit="m"), 0, 100)] = ()
    """Lateral positions of the cubes of one placement, metres to the left, nearest first; []
    for held-out placements."""

    def run(self, folder: Path) -> tuple[int, float]:
        """Compute outcome probabilities; return the exit status and the success probability."""
        settings, cubes = self.as_base(ChanceSettings), self.cubes or None
        how = {**self.shared(), "progress": bar_or_lines()}
        result = drone_rl.chances(self.policy, cubes, settings, **how)
        finish(result, folder / "chances.json")
        return 0, result.success
