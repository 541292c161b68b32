"""Run tests in forks of this process, which has imported the libraries but not the package."""

import contextlib
import dataclasses
import gc
import importlib
import importlib.abc
import importlib.machinery
import linecache
import math
import os
import re
import resource
import shutil
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from tools.mutants.recording import InstrumentingFinder, Recorder, record_launches

LIBRARIES = (
    "torch",
    "torchrl.envs.libs.dm_control",
    "torchrl.collectors",
    "torchrl.objectives",
    "warp",
    "mujoco_warp",
    "dm_control.composer",
    "scipy.stats",
    "hypothesis",
    "hypothesis.extra.numpy",
    "captum.attr",
    "openTSNE",
    "imageio",
    "PIL.Image",
    "safetensors.torch",
    "hydra",
    "jinja2",
    "_hypothesis_pytestplugin",
)
PACKAGE = "drone_rl"
"""Package whose executed blocks are recorded."""
MAX_WALL_RATIO = 10.0
"""Greatest ratio of wall-clock to processor time; a run that exceeds it has a deadlock."""
MEMORY_BYTES = 6 << 30
"""Memory limit of a run; a mutant can turn a product of sizes into a power."""
OPTIONS = (
    "-q",
    "--no-header",
    "--tb=line",
    *("-p", "no:cacheprovider"),
    *("-p", "no:unraisableexception"),  # its garbage collections take 1 s
    *("-W", "ignore"),
    *("-m", "not render"),
)


@dataclasses.dataclass(frozen=True)
class Run:
    """A run of tests on a copy of the tree, with the source of one module replaced in memory."""

    name: str
    tests: Sequence[str]
    limit_s: float
    """Limit of processor time; the limit of wall-clock time is MAX_WALL_RATIO times that."""
    module: str | None = None
    """Path of the mutated module relative to the tree; None for the original program."""
    source: str = ""
    first: Sequence[str] = ()
    """Tests to run in the same process before `tests`."""
    then: Sequence[str] = ()
    """Tests to run in the same process if `tests` have passed."""
    skip: Sequence[str] = ()
    """Tests to deselect because they fail without a mutation."""
    record: Path | None = None
    """File for the blocks that each test executes; if set, all tests run even after a failure."""


@dataclasses.dataclass(frozen=True)
class Outcome:
    """The outcome of a run."""

    run: Run
    status: str
    """"passed", "failed" (also a crash), or "timeout"."""
    seconds: float
    """Processor time."""
    output: str

    @property
    def failing(self) -> str | None:
        """The test that failed; None if no test did or after a crash."""
        found = re.search(r"^(?:FAILED|ERROR) (\S+\.py(?:::.*?)?)(?: - .*)?$", self.output, re.M)
        return found and found[1]


def import_libraries(kernels: Path) -> None:
    """Import the libraries, which take most of the start of a test run, but not the package.

    Args:
        kernels: Folder for compiled kernels, including those of mutants.

    Raises:
        RuntimeError: The package was imported, so a fork would not run the mutated source.
    """
    os.environ["OMP_NUM_THREADS"] = "1"
    os.environ["WARP_CACHE_PATH"] = str(kernels)
    for name in LIBRARIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    import hypothesis

    hypothesis.settings.register_profile("mutants", derandomize=True, deadline=None, database=None)
    hypothesis.settings.load_profile("mutants")
    if "warp" in sys.modules:  # level 0 rounds differently, level 1 does not
        sys.modules["warp"].config.optimization_level = 1
    if any(name.partition(".")[0] == "drone_rl" for name in sys.modules):
        raise RuntimeError("drone_rl was imported before the fork")
    gc.freeze()  # exempt imported objects from collection in the children


def run_all(runs: Iterator[Run], tree: Path, scratch: Path, jobs: int) -> Iterator[Outcome]:
    """Execute runs in parallel and yield each outcome as it completes.

    Args:
        runs: The runs, started in this order.
        tree: The copy of the project.
        scratch: Folder for outputs and temporary files.
        jobs: Number of parallel processes.
    """
    running: dict[int, tuple[Run, float]] = {}
    while True:
        while len(running) < jobs and (run := next(runs, None)) is not None:
            running[_start(run, tree, scratch)] = (run, time.monotonic())
        if not running:
            return
        yield from _finished(running, scratch)
        time.sleep(0.02)


def _finished(running: dict[int, tuple[Run, float]], scratch: Path) -> Iterator[Outcome]:
    for pid, (run, begin) in list(running.items()):
        ended, code, used = os.wait4(pid, os.WNOHANG)
        late = not ended and time.monotonic() - begin > MAX_WALL_RATIO * run.limit_s
        if late:
            os.killpg(pid, signal.SIGKILL)
            _, code, used = os.wait4(pid, 0)
        elif ended:
            with contextlib.suppress(ProcessLookupError):  # processes that a test left running
                os.killpg(pid, signal.SIGKILL)
        else:
            continue
        del running[pid]
        output = (scratch / f"{run.name}.txt").read_text(errors="replace")
        seconds = used.ru_utime + used.ru_stime
        late = late or (os.WIFSIGNALED(code) and os.WTERMSIG(code) == signal.SIGXCPU)
        status = "timeout" if late else "passed" if code == 0 else "failed"
        shutil.rmtree(scratch / run.name, ignore_errors=True)
        yield Outcome(run, status, seconds, output)


def _start(run: Run, tree: Path, scratch: Path) -> int:
    if pid := os.fork():
        with contextlib.suppress(PermissionError, ProcessLookupError):  # the child was faster
            os.setpgid(pid, pid)
        return pid
    code = 70
    try:
        os.setpgid(0, 0)
        with (scratch / f"{run.name}.txt").open("wb") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__  # the parent's may be captured
        code = _test(run, tree, scratch / run.name)
        sys.stdout.flush()
    finally:
        os._exit(code)


def _test(run: Run, tree: Path, temporary: Path) -> int:
    """Run pytest in the child and return its exit status, which is 0 if all tests passed."""
    # The soft limit sends SIGXCPU, which nothing else does. The time that `wait4` reports does not
    # show a timeout: the limit counts scheduler ticks, which can exceed the time used.
    limit_s = math.ceil(run.limit_s)
    resource.setrlimit(resource.RLIMIT_CPU, (limit_s, limit_s + 60))
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
    os.chdir(tree)
    os.environ["PYTHONPATH"] = str(tree)  # for the processes that tests start
    sys.path.insert(0, str(tree))
    if run.module is not None:
        sys.meta_path.insert(0, _MutantFinder(run.module, run.source))
    options = [*OPTIONS, f"--basetemp={temporary}", *(f"--deselect={t}" for t in run.skip)]
    if run.record is None:
        stages = [tests for tests in (run.first, run.tests, run.then) if tests]
        return next(filter(None, (int(pytest.main(["-x", *options, *t])) for t in stages)), 0)
    recorder = Recorder(run.record)
    record_launches(recorder)
    sys.meta_path.insert(0, InstrumentingFinder(PACKAGE))
    return int(pytest.main([*options, *run.tests], plugins=[recorder]))


class _MutantFinder(importlib.abc.MetaPathFinder):
    """Finds one module and loads it from mutated source."""

    def __init__(self, path: str, source: str) -> None:
        self.name = path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")
        self.path, self.source = path, source

    def find_spec(self, fullname: str, path: object, target: object = None) -> object:
        if fullname != self.name:
            return None
        found = importlib.machinery.PathFinder.find_spec(fullname, path)
        found.loader = _MutantLoader(fullname, found.origin, self.source)
        return found


class _MutantLoader(importlib.machinery.SourceFileLoader):
    def __init__(self, name: str, path: str, source: str) -> None:
        super().__init__(name, path)
        self._source = source

    def get_code(self, fullname: str) -> object:
        # Warp compiles the source that `inspect` finds in this cache. Entries without a time stay.
        lines = self._source.splitlines(keepends=True)
        linecache.cache[self.path] = (len(self._source), None, lines, self.path)
        return compile(self._source, self.path, "exec", dont_inherit=True)
