"""Test runs in forks of this process, which has imported the libraries but not the program."""

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

from tools.mutants.recording import CountedFinder, Recorder, record_launches

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
"""Of which it is recorded which blocks run."""
WAIT = 10.0
"""Seconds that may pass for each of processor time; more is a deadlock."""
MEMORY_BYTES = 6 << 30
"""A mutant that wants more is killed: a size that became a power, say."""
OPTIONS = (
    "-q",
    "--no-header",
    "--tb=line",
    *("-p", "no:cacheprovider"),
    *("-p", "no:unraisableexception"),  # collects garbage of all libraries twice, for 1 s
    *("-W", "ignore"),
    *("-m", "not render"),
)


@dataclasses.dataclass(frozen=True)
class Run:
    """Tests to run on a copy of the tree, with one module's source replaced in memory."""

    name: str
    tests: Sequence[str]
    limit_s: float
    """Of processor time, which a busy machine does not use up; of patience WAIT times that."""
    module: str | None = None
    """Path of the mutated module below the tree; None for the tree as it is."""
    source: str = ""
    then: Sequence[str] = ()
    """Tests to run if the others have passed, in the same process."""
    leave_out: Sequence[str] = ()
    """Tests that fail without a mutation too."""
    record: Path | None = None
    """Where to write which blocks of which tests run; all tests run then, whatever fails."""


@dataclasses.dataclass(frozen=True)
class Outcome:
    """How a run ended."""

    run: Run
    status: str
    """"passed", "failed" (also a crash), or "timeout"."""
    seconds: float
    """Of processor time."""
    output: str

    @property
    def failing(self) -> str | None:
        """The test that failed; None without one, as after a crash."""
        found = re.search(r"^(?:FAILED|ERROR) (\S+\.py(?:::.*?)?)(?: - .*)?$", self.output, re.M)
        return found and found[1]


def import_libraries(kernels: Path) -> None:
    """Imports what takes most of a test run's start; nothing of the program.

    Args:
        kernels: Folder for compiled kernels, those of mutants too.

    Raises:
        RuntimeError: The program was imported, so that a fork would not see a mutation.
    """
    os.environ["OMP_NUM_THREADS"] = "1"
    os.environ["WARP_CACHE_PATH"] = str(kernels)
    for name in LIBRARIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    import hypothesis

    hypothesis.settings.register_profile("mutants", derandomize=True, deadline=None, database=None)
    hypothesis.settings.load_profile("mutants")
    if "warp" in sys.modules:  # at level 0 results differ by rounding, at 1 they don't
        sys.modules["warp"].config.optimization_level = 1
    if any(name.partition(".")[0] == "drone_rl" for name in sys.modules):
        raise RuntimeError("drone_rl was imported before the fork")
    gc.freeze()  # what is imported stays for good: no child looks through it


def run_all(runs: Iterator[Run], tree: Path, scratch: Path, jobs: int) -> Iterator[Outcome]:
    """Runs tests, `jobs` at a time, and yields each outcome as it comes.

    Args:
        runs: In this order.
        tree: The copy of the project.
        scratch: Folder for outputs and temporary files.
        jobs: Processes at once.
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
        late = not ended and time.monotonic() - begin > WAIT * run.limit_s
        if late:
            os.killpg(pid, signal.SIGKILL)
            _, code, used = os.wait4(pid, 0)
        elif ended:
            with contextlib.suppress(ProcessLookupError):  # what a test left behind
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
        sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__  # not a parent's captured ones
        code = _test(run, tree, scratch / run.name)
        sys.stdout.flush()
    finally:
        os._exit(code)


def _test(run: Run, tree: Path, temporary: Path) -> int:
    """Runs pytest in the child. Returns its exit status; 0 is that all tests passed."""
    # At the first limit comes SIGXCPU, which nothing else sends. How much time was used doesn't
    # tell: the limit counts ticks, which a busy machine gives for less time than `wait4` says.
    limit_s = math.ceil(run.limit_s)
    resource.setrlimit(resource.RLIMIT_CPU, (limit_s, limit_s + 60))
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
    os.chdir(tree)
    os.environ["PYTHONPATH"] = str(tree)  # for the processes that tests start
    sys.path.insert(0, str(tree))
    if run.module is not None:
        sys.meta_path.insert(0, _Replaced(run.module, run.source))
    options = [*OPTIONS, f"--basetemp={temporary}", *(f"--deselect={t}" for t in run.leave_out)]
    if run.record is None:
        stages = [tests for tests in (run.tests, run.then) if tests]
        return next(filter(None, (int(pytest.main(["-x", *options, *t])) for t in stages)), 0)
    recorder = Recorder(run.record)
    record_launches(recorder)
    sys.meta_path.insert(0, CountedFinder(PACKAGE))
    return int(pytest.main([*options, *run.tests], plugins=[recorder]))


class _Replaced(importlib.abc.MetaPathFinder):
    """Finds one module, and gives it other source than its file has."""

    def __init__(self, path: str, source: str) -> None:
        self.name = path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")
        self.path, self.source = path, source

    def find_spec(self, fullname: str, path: object, target: object = None) -> object:
        if fullname != self.name:
            return None
        found = importlib.machinery.PathFinder.find_spec(fullname, path)
        found.loader = _Loader(fullname, found.origin, self.source)
        return found


class _Loader(importlib.machinery.SourceFileLoader):
    def __init__(self, name: str, path: str, source: str) -> None:
        super().__init__(name, path)
        self._source = source

    def get_code(self, fullname: str) -> object:
        # Warp compiles what `inspect` finds in this cache; without a time it's never read again.
        lines = self._source.splitlines(keepends=True)
        linecache.cache[self.path] = (len(self._source), None, lines, self.path)
        return compile(self._source, self.path, "exec", dont_inherit=True)
