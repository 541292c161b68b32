"""Figures of tasks made of terms, with a user's files in a folder outside of the repository."""

import ast
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.commands import call
from benchmarks.maps import count_maps_in_flights
from benchmarks.pipeline import paired
from benchmarks.startup import first_update_seconds
from drone_rl.config.learning import Episodes
from drone_rl.config.task import BaseTaskSettings
from drone_rl.config.training import TrainSettings
from drone_rl.policies.policy import load_policy
from drone_rl.training.train import make_collector
from drone_rl.trust.results import Verdict
from drone_rl.trust.rule import VerdictKind
from drone_rl.utils.exit_codes import NOT_CERTAIN
from drone_rl.utils.files import read_json
from drone_rl.utils.plugins import import_plugin

_HERE = Path(__file__).parent
_ROOT = _HERE.parents[1]
TASK, TERM = "reach_ball.py", "near_wall.py"
"""The user's files: a task, and a reward term for another run."""
_PROGRAMS = {"Gymnasium": "gymnasium_program.py", "SB3": "sb3_program.py"}
SEARCHED = (
    "task.reward.facing.weight=tag(log,interval(1e-3,0.3))",
    "task.reward.progress.weight=interval(0.05,0.2)",
)
"""Weights that a search varies. A drone that faces the ball without reaching it is paid longer."""
SOLVED = ("objective.entropy_coeff=0.03", "trainer.confirm_share=0.99")
"""Settings of the trainings: flying straight on is a local optimum, and a policy without memory
flies into some boxes that it has passed."""
_SHIPPED = re.compile(r"collect_cubes|collect_one|CollectCubes|pillars|Pillars")
_EXEMPT = ("sim/tasks/", "verification/", "flight/")
"""Folders that may name shipped tasks."""
_STATUSES = (NOT_CERTAIN, *(kind.exit_code for kind in VerdictKind))


def bench_tasks(setup: Setup) -> dict[str, Any]:
    """Measure a user's term and task, and what the package knows about its own tasks.

    Returns:
        "reward_term_...": lines of a term, collecting rate with it over that without, seconds from
        an edit to the first update; "own_task_...": lines of a task, commands that work on it, and
        of trainings from each seed the verdicts, the smallest lower bound of the success rate and
        the most seconds until a verdict; seconds of `drone-rl explain`; adversarial maps that it
        trusts and true maps that it finds; "search_success" of the best trial and
        "search_by_reward" of that with the largest running reward; "task_methods" of the largest
        class of tasks; "task_named", files that name a shipped task.
    """
    with own_files() as own:
        runs = setup.runs / "own_task"
        return {
            "reward_term_lines": _num_lines(own / TERM),
            "reward_term_ratio": _rate_with_term(own, setup.quick),
            "reward_term_s": _seconds_from_edit(own, runs / "edit", setup.device),
            "own_task_lines": _num_lines(own / TASK),
            **_trained(own, runs, setup),
            **_searched(own, runs / "search", setup),
            "task_methods": max(_methods().values()),
            "task_named": len(_naming_files()),
        }


@contextmanager
def own_files() -> Iterator[Path]:
    """Provide a folder outside of the repository with copies of the user's files."""
    with tempfile.TemporaryDirectory() as folder:
        for name in (TASK, TERM, *_PROGRAMS.values()):
            shutil.copy(_HERE / name, folder)
        yield Path(folder)


def _num_lines(path: Path) -> int:
    return sum(bool(line.strip()) for line in path.read_text().splitlines())


# A reward term


def _rate_with_term(own: Path, quick: bool) -> float:
    """Return the rate of fused collecting with the term divided by that without."""
    for name in (TASK, TERM):
        import_plugin(str(own / name))
    plain = {"name": "reach_ball"}
    rewards = BaseTaskSettings.read(plain, "task").values()["reward"]
    tasks = [{**plain, "reward": {**rewards, "near_wall": {}}}, plain]
    collectors = [_collector(BaseTaskSettings.read(task, "task")) for task in tasks]
    work = [partial(_collect, collector) for collector in collectors]
    for collect_once in work:  # compiles
        collect_once()
    seconds, rounds = (0.5, 3) if quick else (2.0, 15)
    _, _, ratio = paired(*work, seconds=seconds, rounds=rounds)
    for collector in collectors:
        collector.shutdown()
    return ratio


def _collector(task: BaseTaskSettings) -> Any:
    settings = TrainSettings(task=task, collector=Episodes(num_envs=64))
    return make_collector(settings).collector


def _collect(collector: Any) -> int:
    return next(iter(collector)).numel()


def _seconds_from_edit(own: Path, folder: Path, device: str) -> float:
    """Return the seconds from a new version of the term to the first update of a training."""
    path = own / TERM
    path.write_text(path.read_text().replace("1.0, 0.0", f"{time.time() % 1e6:.3f}, 0.0"))
    files = f"plugins=[{own / TASK},{path}]"
    term = "task.reward.near_wall.weight=-0.3"
    return first_update_seconds(folder, device, settings=("task=reach_ball", files, term))


# A task


def _trained(own: Path, runs: Path, setup: Setup) -> dict[str, Any]:
    """Train the task from each seed, judge the policies, and run all commands on the first."""
    brief = ["trainer.total_frames=20000"] if setup.quick else []
    seconds, verdicts = [], list[Verdict]()
    for seed in setup.seeds[:3]:
        begin, run = time.perf_counter(), runs / f"train_{seed}"
        _call(own, "train", "task=reach_ball", run, f"seed={seed}", *(brief or SOLVED))
        judged = runs / f"verdict_{seed}"
        _call(own, "verdict", f"policy={run}", judged, statuses=_STATUSES)
        seconds.append(time.perf_counter() - begin)
        verdicts.append(Verdict.read(_known(read_json(judged / "verdict.json"))))
    first = runs / f"train_{setup.seeds[0]}"
    works, explain_s = _run_commands(own, first, runs / "commands", setup.quick)
    return {
        "own_task_kinds": [f"{v.kind}{'' if v.certain else ' (not certain)'}" for v in verdicts],
        "own_task_lower95": min(v.greedy.success.lower95 for v in verdicts),
        "own_task_s": max(seconds),
        "own_task_commands": sum(why is None for why in works.values()),
        "own_task_failing": {name: why for name, why in works.items() if why is not None},
        "own_task_explain_s": explain_s,
        **_maps(own, first, setup.quick),
    }


def _known(content: dict[str, Any]) -> dict[str, Any]:
    """Return the entries of a judgement that its verdict has, too."""
    return {name: value for name, value in content.items() if name in Verdict.model_fields}


def _call(
    own: Path, command: str, what: str, folder: Path, *args: str, statuses: tuple[int, ...] = (0,)
) -> None:
    """Run a command with the task's file as plugin, in the user's folder."""
    plugin = f"plugins={own / TASK}"
    call(command, what, plugin, f"hydra.run.dir={folder}", *args, statuses=statuses, folder=own)


def _run_commands(
    own: Path, run: Path, folder: Path, quick: bool
) -> tuple[dict[str, str | None], float]:
    """Run every command on a trained policy; return why those that fail do, by name, and seconds.

    A command works if it ends with success and its output has what a user looks for. The seconds
    are those of `explain`.
    """
    few = ["frames=100", "perplexity=10", "episodes=50"] if quick else []

    def has(*names: str, in_: Callable[[Path], bool] = lambda _: True) -> Callable[[Path], bool]:
        return lambda made: all((made / name).is_file() for name in names) and in_(made)

    checks: dict[str, tuple[list[str], Callable[[Path], bool]]] = {
        "evaluate": (["episodes=100"], has("evaluation.json", "videos/episode_0.mp4")),
        "verdict": (["episodes=100"], has("verdict.json", in_=_is_reach)),
        "shifts": (["axes=[fog,noise]", "episodes=50"], has("shifts.png", in_=_has_levels)),
        "explain": (few, has("report.html", in_=_is_explained)),
        "class-models": ([], has("class_models.png", "class_models.json")),
        "play": (["episodes=1"], has("episode_0.mp4")),
        "export": (["episodes=100"], has("policy.md", in_=_is_loaded)),
    }
    trained = has("result.json", "checkpoints/last.pt", in_=_has_success)
    works: dict[str, str | None] = {"train": None if trained(run) else "no success was logged"}
    seconds = math.nan
    for name, (args, is_right) in checks.items():
        begin, made = time.perf_counter(), folder / name
        try:
            _call(own, name, f"policy={run}", made, *args, statuses=_STATUSES)
            works[name] = None if is_right(made) else "its output lacks something"
        except RuntimeError as error:
            works[name] = str(error)
        if name == "explain":
            seconds = time.perf_counter() - begin
    call("plot", str(run), f"hydra.run.dir={folder / 'plot'}", folder=own)
    works["plot"] = None if has("curves.png")(folder / "plot") else "no curves.png"
    return works | {name: _run_program(own, file) for name, file in _PROGRAMS.items()}, seconds


def _has_success(run: Path) -> bool:
    return "end/success" in (run / "metrics.csv").read_text().partition("\n")[0].split(",")


def _is_reach(made: Path) -> bool:
    sentence = read_json(made / "verdict.json")["sentence"]
    return "thresholds are absolute" in sentence and "trivial" not in sentence


def _has_levels(made: Path) -> bool:
    axes = read_json(made / "shifts.json")["axes"]
    return all(level["modes"] for axis in axes.values() for level in axis["levels"])


def _is_explained(made: Path) -> bool:
    """Whether heat maps were tested, class models made and frames embedded."""
    (path,) = made.glob("*/explanation.json")
    found = read_json(path)
    return all(found.get(name) for name in ("attribution", "class_model", "tsne"))


def _is_loaded(made: Path) -> bool:
    return load_policy(made / "policy.safetensors").task.name == "reach_ball"


def _run_program(own: Path, name: str) -> str | None:
    """Run a Python program of the user; return why it fails, None if it counts episodes."""
    process = subprocess.run(
        [sys.executable, name],
        capture_output=True,
        text=True,
        check=False,
        cwd=own,
        env={**os.environ, "PYTHONPATH": str(_ROOT)},
    )
    if process.returncode:
        return process.stderr.strip()[-500:]
    return None if json.loads(process.stdout.splitlines()[-1])["episodes"] else "no episodes"


def _maps(own: Path, run: Path, quick: bool) -> dict[str, Any]:
    """Count trusted adversarial maps and true maps that are found, in frames of the policy."""
    import_plugin(str(own / TASK))
    return count_maps_in_flights(load_policy(run), "own_task", quick)


def _searched(own: Path, folder: Path, setup: Setup) -> dict[str, Any]:
    """Search two weights for success; compare with the trial of the largest running reward."""
    trials, frames = (2, 4000) if setup.quick else (12, 100_000)
    call(
        "train",
        "-m",
        "hydra/sweeper=optuna",
        "hydra.sweeper.metric=success",
        f"hydra.sweeper.num_trials={trials}",
        f"hydra.sweep.dir={folder}",
        "task=reach_ball",
        f"plugins={own / TASK}",
        *SEARCHED,
        f"trainer.total_frames={frames}",
        "trainer.target_share=null",
        "logger=csv",
        folder=own,
    )
    results = [read_json(path) for path in folder.rglob("result.json")]
    successes = [r["confirming_flights_succeeded"] / r["confirming_flights"] for r in results]
    rewards = [r["running_reward"] for r in results]
    return {
        "search_success": max(successes),
        "search_by_reward": successes[rewards.index(max(rewards))],
    }


# The package


def _methods() -> dict[str, int]:
    """Return the number of methods of each class of tasks, its own and those of its bases."""
    classes = dict[str, ast.ClassDef]()
    for path in (_ROOT / "drone_rl" / "sim").rglob("*.py"):
        nodes = ast.walk(ast.parse(path.read_text()))
        classes |= {node.name: node for node in nodes if isinstance(node, ast.ClassDef)}
    return {
        name: len(_own_methods(node))
        for name, node in classes.items()
        if "Task" in _bases(node, classes) and name != "Task"
    }


def _bases(node: ast.ClassDef, classes: dict[str, ast.ClassDef]) -> set[str]:
    names = {ast.unparse(base).partition("[")[0] for base in node.bases}
    return names.union(*(_bases(classes[name], classes) for name in names & classes.keys()))


def _own_methods(node: ast.ClassDef) -> set[str]:
    return {part.name for part in node.body if isinstance(part, ast.FunctionDef)}


def _naming_files() -> list[str]:
    """Return the Python files outside of `_EXEMPT` that name a shipped task."""
    package = _ROOT / "drone_rl"
    files = {path.relative_to(package).as_posix(): path for path in package.rglob("*.py")}
    return [
        name
        for name, path in files.items()
        if not name.startswith(_EXEMPT) and _SHIPPED.search(path.read_text())
    ]
