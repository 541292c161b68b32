"""`drone-rl bench`: run benchmarks of a checkout."""

import importlib
import json
import logging
import textwrap
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from drone_rl.cli.settings import CommandSettings
from drone_rl.config.commands import BenchSettings
from drone_rl.utils.errors import InputError

_log = logging.getLogger(__name__)


class BenchCommand(CommandSettings, BenchSettings):
    """Measure the figures that the documentation quotes."""

    @classmethod
    def description(cls) -> str:
        """Return the benchmarks by group, too; see `CommandSettings`."""
        registry = _benchmarks()
        groups = (
            f"{group}: {', '.join(registry.find_benchmarks([group]))}" for group in registry.GROUPS
        )
        lines = (
            textwrap.fill(group, 100, initial_indent="  ", subsequent_indent="    ")
            for group in groups
        )
        return "\n".join([super().description(), "", "Benchmarks by group:", *lines])

    @classmethod
    def prepare(cls, overrides: Sequence[str]) -> list[str]:
        """Translate `drone-rl bench collector --quick` to `only=[collector] quick=true`."""
        find_benchmarks = _benchmarks().find_benchmarks
        words = [o for o in overrides if "=" not in o and not o.startswith("-")]
        names = find_benchmarks(words)
        kept = [o for o in overrides if o not in (*words, "--quick")]
        quick = "--quick" in overrides
        if quick and not names and not any(o.startswith("only=") for o in kept):
            names = find_benchmarks(["main"])
        if names:
            kept.append(f"only=[{','.join(names)}]")
        return [*kept, "quick=true"] if quick else kept

    def run(self, folder: Path) -> tuple[int, None]:
        """Run benchmarks and write results.json; raise an `InputError` at the end if one failed."""
        registry = _benchmarks()
        from benchmarks.benchmark import Setup
        from benchmarks.ledger import Ledger
        from benchmarks.run import run_benchmarks

        results = Path(self.folder) / "quick" if self.quick else Path(self.folder)
        results.mkdir(parents=True, exist_ok=True)
        setup = Setup.from_settings(self, results)
        ledger = Ledger(results / "results.json")
        names = (
            list(registry.BENCHMARKS) if self.only is None else registry.find_benchmarks(self.only)
        )
        failures = run_benchmarks(names, setup, ledger, again=self.only is not None)
        print(json.dumps({name: ledger.of(name) for name in names}, indent=2))
        _log.info("results: %s", ledger.path)
        if failures:
            reasons = "; ".join(f"{name}: {why}" for name, why in failures.items())
            raise InputError(f"benchmarks failed: {reasons}")
        return 0, None


def _benchmarks() -> ModuleType:
    """Import the registry of benchmarks, which is in a checkout but not in an installed wheel."""
    try:
        return importlib.import_module("benchmarks.registry")
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "benchmarks":
            raise
        raise InputError(
            "drone-rl bench needs a checkout of the project (the package benchmarks is not "
            "installed); clone the repository and run make demo, then drone-rl bench, in it"
        ) from error
