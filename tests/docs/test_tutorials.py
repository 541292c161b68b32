"""The Python of every page runs block by block, with smaller sizes.

`python -m tools.docs` runs pages and commands with their own sizes and compares the outputs.
"""

import gc
import sys
from unittest.mock import patch

import jinja2
import pytest
import torch
from hydra.core.config_store import ConfigStore

import drone_rl.explanations
from drone_rl.cli.hydra import composition
from drone_rl.config import TASKS
from drone_rl.config.terms import REWARDS
from drone_rl.explanations import report
from drone_rl.explanations.report import page as report_page
from drone_rl.sim.tasks.task import MAKERS
from tests.docs.commands import check_commands
from tests.explanations.quick import few_sections, quick_figures
from tools.docs import session
from tools.docs.blocks import PYTHON, find_pages, read_blocks
from tools.docs.outputs import find_different_words
from tools.docs.rules import read_rules

PAGES = [page for page in find_pages() if any(b.kind == PYTHON for b in read_blocks(page))]
SHORT = (
    "trainer=drone_rl.TrainerSettings(total_frames=400, checkpoint_interval_s=0.0), "
    "collector=drone_rl.config.learning.Episodes(num_envs=4)"
)
_MAIN = {
    "judge(training.policy)": "judge(training.policy, episodes=8)",
    "episodes=200": "episodes=8",
}
_FEW_FRAMES = "frames=30, episodes=8, perplexity=5)"
SMALLER = {
    "README.md": {
        "train(seed=1)": f"train(seed=1, {SHORT})",
        'explain(["good", "poor"])': f'explain(["good"], {_FEW_FRAMES}',
        **_MAIN,
    },
    "docs/tour.md": {
        "seed=1)": f"seed=1, {SHORT})",
        'explain("good")': f'explain("good", {_FEW_FRAMES}',
        **_MAIN,
    },
    "docs/tutorials/notebook.md": {
        "train(seed=1)": f"train(seed=1, {SHORT})",
        "judge(policy)": "judge(policy, episodes=8)",
        "episodes=200": "episodes=8",
        'explain([policy, "poor"], ': "explain([policy], frames=30, episodes=8, perplexity=5, ",
    },
    "docs/tutorials/returns.md": {"seed=1)": f"seed=1, {SHORT})"},
    "docs/tutorials/network.md": {"seed=1)": f"seed=1, {SHORT})", "episodes=200": "episodes=8"},
    "docs/tutorials/motion.md": {
        "100": "10",
        "make_env(64": "make_env(8",
        "total_frames=400_000": "total_frames=2_000",
    },
    "docs/tutorials/task.md": {
        "make_env(64": "make_env(8",
        "total_frames=100_000": "total_frames=500",
        "actor, 400": "actor, 20",
        "episodes=400": "episodes=8",
    },
    "docs/tutorials/learner.md": {
        "make_env(64": "make_env(8",
        "total_frames=200_000": "total_frames=500",
        "total_frames=20_000": "total_frames=1_000",
        "total_frames=10_000": "total_frames=500",
    },
    "docs/tutorials/sb3.md": {
        "num_envs=32": "num_envs=4",
        '"n_steps": 128': '"n_steps": 16',
        '"batch_size": 512': '"batch_size": 64',
        "n_eval_episodes=200, eval_freq=128": "n_eval_episodes=4, eval_freq=16",
        "200_000": "64",
        "episodes=400": "episodes=8",
        'folder="outputs/explain/sb3"': 'folder="sb3", frames=30, episodes=6, perplexity=5',
    },
    "docs/tutorials/section.md": {
        "frames=120": "frames=30, perplexity=5",
        "make_env(64)": "make_env(30)",
    },
}
"""What the tests change of a page, and into what."""


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    """A folder as a reader's: modules are found there, and so are files for the package."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    gc.freeze()  # what was there before is not collected below, which takes a second
    inside = tmp_path / "drone_rl"
    for package in (drone_rl.explanations, report):
        folder = inside.joinpath(*package.__name__.split(".")[1:])
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(folder)])
    monkeypatch.setattr(composition, "IMPORTED", [])  # other tests of this process don't find them
    monkeypatch.setattr(report_page, "PARTS", dict(report_page.PARTS))
    known, threads = set(sys.modules), torch.get_num_threads()
    templates = jinja2.FileSystemLoader(inside / "explanations" / "report" / "templates")
    load = jinja2.PackageLoader
    monkeypatch.setattr(
        jinja2, "PackageLoader", lambda package: jinja2.ChoiceLoader([load(package), templates])
    )
    report_page._environment.cache_clear()  # another tutorial may have made it, with another loader
    few = few_sections("dataset", "verdict")
    with (
        patch.dict(TASKS),
        patch.dict(MAKERS),
        patch.dict(REWARDS.by_name),
        few,
        quick_figures(),
    ):  # a page's tasks and terms are registered until its end
        yield tmp_path
    report_page._environment.cache_clear()
    forget_choices()
    torch.set_num_threads(threads)
    for name in set(sys.modules) - known:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]
    gc.collect()
    gc.unfreeze()


def forget_choices():
    """Remove the parts of plug-ins from the registries and Hydra's groups."""
    stored = ConfigStore.instance().repo
    registries = {group: part.registry for group, part in composition.PARTS.items()}
    registries |= {group: part.registry for group, part in composition.SEVERAL.items()}
    for group, registry in {"task": TASKS, **registries}.items():
        for name, part in [*registry.items()]:
            if not part.__module__.startswith("drone_rl."):
                del registry[name]
        nodes = stored.get(group, {})
        for name in [name for name in nodes if name.removesuffix(".yaml") not in registry]:
            if group not in composition.SEVERAL:
                del nodes[name]


def show(value):
    """Display the value of a block's last line as a notebook would."""
    if hasattr(value, "_repr_html_"):
        assert value._repr_html_().startswith("<")
    else:
        session.show(value)


def shrink(page, code):
    """Return the code with the sizes of the tests."""
    for large, small in SMALLER.get(page, {}).items():
        code = code.replace(large, small)
    return code


@pytest.mark.parametrize("page", PAGES)
def test_it_runs(page, workplace):
    if page.endswith("sb3.md"):
        pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
    names, rules = {"__name__": "__main__"}, read_rules(page)
    for block in read_blocks(page):
        if block.title:
            (workplace / block.title).parent.mkdir(parents=True, exist_ok=True)
            (workplace / block.title).write_text(block.code)
        elif rules.why_not_run(block):
            continue
        elif block.kind == PYTHON:
            code = shrink(page, block.code)
            printed = session.run_python(code, f"{page}:{block.line}", names, show)
            if page not in SMALLER:
                assert find_different_words(block.shown, printed) is None
        elif "plugins=" in block.code:  # tests/docs/test_pages.py checks the other commands
            assert check_commands(block.code)


@pytest.mark.parametrize("page", SMALLER)
def test_smaller_sizes_are_those_of_the_page(page):
    code = "".join(block.code for block in read_blocks(page))
    assert [large for large in SMALLER[page] if large not in code] == []


def test_a_minimal_task_takes_at_most_80_lines():
    (post,) = [b.code for b in read_blocks("docs/tutorials/task.md") if b.title == "post.py"]
    assert len(post.splitlines()) <= 80
