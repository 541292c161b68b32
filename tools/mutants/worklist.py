"""The list of mutants and a sample of it, stored in a Cosmic Ray session."""

import dataclasses
import functools
import hashlib
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import cosmic_ray.plugins
from cosmic_ray.commands.init import init
from cosmic_ray.mutating import mutate_code
from cosmic_ray.work_db import WorkDB
from cosmic_ray.work_item import MutationSpec, WorkerOutcome, WorkResult

from tools.mutants.filters import changes_program, is_of_one_kind, is_within, silent_spans
from tools.mutants.operators import Provider, SameKindProvider

_PROVIDERS = cosmic_ray.plugins.OPERATOR_PROVIDERS
_PROVIDERS |= {"drone_rl": Provider(), "core": SameKindProvider(_PROVIDERS["core"])}
FILTERED = "changes no behaviour, or only crashes"
"""Output of mutants that the filters exclude."""


@dataclasses.dataclass(frozen=True)
class Mutant:
    """One mutation of one module."""

    id: str
    """Unchanged while the text of the mutated line is, even if the line moves."""
    job: str
    """Id of the job in the session."""
    spec: MutationSpec

    @property
    def module(self) -> str:
        """Path of the module relative to the tree."""
        return self.spec.module_path.as_posix()

    def source(self, root: Path) -> str | None:
        """Return the source of the mutated module; None if there is nothing to mutate."""
        source = (root / self.module).read_text()
        return _mutated(source, self.spec.operator_name, self.spec.occurrence)


@functools.cache
def _mutated(source: str, operator: str, occurrence: int) -> str | None:
    return mutate_code(source, cosmic_ray.plugins.get_operator(operator)(), occurrence)


def fill(
    database: WorkDB,
    root: Path,
    modules: list[str],
    choose: Callable[[list[Mutant]], list[Mutant]],
) -> None:
    """List all mutations of modules and mark those as skipped that are filtered or not chosen.

    Args:
        database: The session, which is emptied first.
        root: The tree, which must be the working directory.
        modules: Paths relative to the tree.
        choose: Selects the mutants to run from all mutants.
    """
    init([Path(module) for module in modules], database, {})
    spans = {module: silent_spans((root / module).read_text()) for module in modules}
    mutants, filtered = [], []
    for mutant in _read_mutants(database, root):
        is_kept = is_of_one_kind(mutant.spec.operator_name) and not is_within(
            mutant.spec.start_pos, spans[mutant.module]
        )
        (mutants if is_kept else filtered).append(mutant)
    chosen = {mutant.job for mutant in choose(mutants)}
    _skip(database, filtered, FILTERED)
    _skip(database, [m for m in mutants if m.job not in chosen], "not in the sample")


def sample_of(database: WorkDB, root: Path) -> tuple[list[Mutant], dict[str, WorkResult], int]:
    """Return the mutants to run, the available results by job, and the number of listed mutants.

    The mutants are sorted by module and position, so partial results are not a random sample.
    """
    results = dict(database.results)
    skipped = {j: r for j, r in results.items() if r.worker_outcome is WorkerOutcome.SKIPPED}
    sample = [m for m in _read_mutants(database, root) if m.job not in skipped]
    filtered = sum(result.output == FILTERED for result in skipped.values())
    done = {job: result for job, result in results.items() if job not in skipped}
    return sample, done, database.num_work_items - filtered


def _skip(database: WorkDB, mutants: list[Mutant], reason: str) -> None:
    """Mark mutants as skipped, as Cosmic Ray's own filters do."""
    result = WorkResult(worker_outcome=WorkerOutcome.SKIPPED, output=reason)
    database.set_multiple_results([mutant.job for mutant in mutants], result)


def _read_mutants(database: WorkDB, root: Path) -> list[Mutant]:
    items = [(item.mutations[0], item.job_id) for item in database.work_items]
    items.sort(key=lambda i: (i[0].module_path, i[0].operator_name, i[0].occurrence))
    lines = {
        spec.module_path: (root / spec.module_path).read_text().splitlines() for spec, _ in items
    }
    seen: Counter[str] = Counter()
    found = []
    for spec, job in items:
        line = lines[spec.module_path][spec.start_pos[0] - 1].strip()
        parts = (spec.module_path.as_posix(), spec.operator_name, spec.definition_name, line)
        name = "|".join(map(str, parts))
        seen[name] += 1
        found.append(Mutant(_digest(f"{name}|{seen[name]}")[:10], job, spec))
    return found


def draw(mutants: list[Mutant], root: Path, size: int, seed: int) -> list[Mutant]:
    """Return a uniform sample of the mutants that change the program.

    It selects the smallest hashes of seed and id, so it changes only where the source changes.
    """
    sample = []
    for mutant in sorted(mutants, key=lambda m: _digest(f"{seed}|{m.id}")):
        if len(sample) == size:
            break
        if changes_program((root / mutant.module).read_text(), mutant.source(root)):
            sample.append(mutant)
    return sample


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
