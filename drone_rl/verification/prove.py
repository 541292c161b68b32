"""`drone-rl prove`: verify a policy over all placements of the cubes."""

import contextlib
import dataclasses
import json
import time
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from drone_rl.config.commands import ProveSettings
from drone_rl.config.configuration import from_arguments
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.policies.zoo import fingerprint
from drone_rl.utils.display import TableResult
from drone_rl.utils.files import as_path, folder_lock, make_folder, write_atomically
from drone_rl.utils.progress import Progress, as_progress
from drone_rl.utils.seeding import fresh_seed, legacy_seed
from drone_rl.utils.text import exact_percent, plural, render
from drone_rl.utils.threads import torch_threads
from drone_rl.verification.checker.certificate import (
    Certificate,
    certificate_file,
    read_certificate,
)
from drone_rl.verification.prover.policy_spec import (
    PolicySpec,
    make_policy_spec,
    partition_placements,
)
from drone_rl.verification.prover.proof_files import certify, load, save
from drone_rl.verification.prover.prover import Prover

STATE_NAME, _CERTIFICATE_NAME = "state.pt", "certificate.json"


@dataclasses.dataclass(frozen=True)
class Proof(TableResult):
    """The exact outcome of every placement of the cubes, as far as it is decided."""

    certificate: Certificate
    """What is proved."""
    folder: Path | None = None
    """The folder of the certificate."""
    is_computed: bool = True
    """Whether it was computed, not only read from a file."""

    @property
    def success(self) -> float:
        """Fraction of all placements from which all cubes are certainly collected."""
        return self.certificate.success

    @property
    def lost(self) -> float:
        """Fraction of all placements from which they certainly are not."""
        return self.certificate.lost

    @property
    def undecided(self) -> float:
        """Fraction of all placements without a claim."""
        return self.certificate.undecided.share

    @property
    def is_proved(self) -> bool:
        """Whether it was computed that the policy succeeds from every placement."""
        return self.is_computed and self.certificate.is_full_success

    def losing(self) -> np.ndarray:
        """Return the boxes of certain failure. Shape: (N, num_cubes, 2), metres."""
        *groups, undecided = self.certificate.groups
        pairs = zip(self.certificate.outcomes, groups, strict=True)
        return np.concatenate([undecided[:0], *(b for o, b in pairs if not o.is_success)])

    def open(self) -> np.ndarray:
        """Return the undecided boxes. Shape: (N, num_cubes, 2), metres."""
        return self.certificate.groups[-1]

    def rows(self) -> list[list[str]]:
        """Return the outcomes as a table: a header, then one row each."""
        rows = [["ends", "collects", "share of placements", "boxes"]]
        for outcome in self.certificate.outcomes:
            end = "to and fro" if outcome.loops else outcome.end.replace("_", " ")
            cubes = "".join(str(k + 1) if c else "-" for k, c in enumerate(outcome.collected))
            rows.append([end, cubes, exact_percent(outcome.share), str(len(outcome.boxes))])
        left = self.certificate.undecided
        return [*rows, ["undecided", "", exact_percent(left.share), str(len(left.boxes))]]

    def notes(self) -> list[str]:
        """Return the statement about all placements."""
        return [render("drone_rl.verification", "proof.j2", of=self, proof=self.certificate)]


def prove(
    policy: str | Path | Policy,
    settings: ProveSettings | None = None,
    *,
    folder: str | Path | None = None,
    task: Mapping[str, Any] | None = None,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    **changes: Any,
) -> Proof:
    """Verify a greedy policy exhaustively over all cube placements.

    Args:
        policy: The policy, or an argument of `load_policy`.
        settings: Settings of the proof.
        folder: Where to save the certificate and, until the proof is finished, its state; an
            unfinished proof there is resumed. Nothing is saved by default.
        task: Changes to the policy's task.
        outputs: See `load_policy`.
        progress: Called with the progress; a bar by default.
        changes: Changes to the settings, as in `prove("good", limit_s=60)`.

    Raises:
        InputError: The policy, its task or a setting is not supported, or the folder holds an
            unfinished proof of another policy, task, logit_gap or renderer; the message says why.
    """
    settings = from_arguments(ProveSettings, settings, changes, prove)
    policy = load_policy(policy, outputs=outputs).in_task(task)
    network, gap = policy.make_network(), settings.logit_gap
    spec = make_policy_spec(policy.description, network, gap, settings.renderer)
    with torch_threads(1), closing(spec), contextlib.ExitStack() as stack:
        partition_placements(spec, settings.most_combinations)  # refuses what takes days
        spec.images.check(settings.compared, np.random.RandomState(legacy_seed(fresh_seed())))
        if folder is not None:
            folder = as_path(folder, "folder")
            make_folder(folder)
            stack.enter_context(folder_lock(folder))
        return _prove(policy, spec, settings, folder, as_progress(progress))


def _prove(
    policy: Policy,
    spec: PolicySpec,
    settings: ProveSettings,
    folder: Path | None,
    progress: Progress,
) -> Proof:
    prover = Prover(spec, settings.most_combinations)
    weights = fingerprint(policy.state.weights)
    subject = [
        weights,
        policy.description.model_dump(mode="json"),
        settings.logit_gap,
        settings.renderer,
    ]
    proof_id = json.dumps(subject)
    state = None if folder is None else folder / STATE_NAME
    if state is not None and state.exists():
        load(prover, state, proof_id)
    begin = time.monotonic()
    stopped = _advance(prover, settings, progress, state, proof_id)
    seconds = time.monotonic() - begin
    certificate = certify(policy.name, policy.description, weights, prover, seconds, stopped)
    if folder is not None and state is not None:
        write_atomically(folder / _CERTIFICATE_NAME, certificate.model_dump_json())
        if prover.is_finished:
            state.unlink(missing_ok=True)
    return Proof(certificate, folder)


def _advance(
    prover: Prover, settings: ProveSettings, progress: Progress, state: Path | None, proof_id: str
) -> str | None:
    """Advance a proof, saving it regularly; return the setting that stops it, if one does."""
    task, last = prover.lattice.task, prover.lattice.last
    total = (2 * task.lateral_bound) ** task.num_cubes
    begin = saved = time.monotonic()
    until, stopped = begin + (np.inf if settings.limit_s is None else settings.limit_s), None
    while not prover.is_finished:
        if time.monotonic() > until or prover.boxes_under_way > settings.most_boxes:
            stopped = "limit_s" if time.monotonic() > until else "most_boxes"
            break
        visited = prover.advance()
        done = prover.decided / total
        text = f"step {visited.ahead} of {last}, {done:.1%} decided, {prover.num_images:,} images"
        at = min(visited.ahead, last - 1)
        if count := len(prover.parts):
            text, at = f"{text}, {plural(count, 'part')} to come", int(done * last)
        progress(text, at, last)
        if state is not None and time.monotonic() - saved > settings.save_interval_s:
            save(prover, state, proof_id)
            saved = time.monotonic()
    if state is not None and stopped:
        save(prover, state, proof_id)
    progress(f"stopped by {stopped}" if stopped else "finished", last, last)
    return stopped


def load_proof(path: str | Path) -> Proof:
    """Load a proof from its certificate, a file or its folder, without checking it; see `check`.

    Raises:
        InputError: There is none, or it is damaged or too large.
    """
    path = certificate_file(path)
    return Proof(read_certificate(path), path.parent, is_computed=False)
