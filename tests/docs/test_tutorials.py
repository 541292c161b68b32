"""Every tutorial runs as it stands, block by block, but for sizes that would take minutes."""

import ast
import gc
import re
import sys
from pathlib import Path
from unittest.mock import patch

import jinja2
import pytest
import torch

import drone_rl.explanations
from drone_rl.config import TASKS
from drone_rl.explanations import explain, report
from drone_rl.explanations.report import page as report_page
from drone_rl.sim.tasks.task import MAKERS
from drone_rl.utils.settings import kinds_of, types_of
from tests.docs.commands import check_commands

DOCS = Path(__file__).parents[2] / "docs"
PAGES = [
    DOCS / "flight.md",
    DOCS / "howto.md",
    DOCS / "pilot.md",
    *sorted((DOCS / "tutorials").glob("*.md")),
]
BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', re.DOTALL | re.MULTILINE)
SHORT = (
    "trainer=drone_rl.TrainerSettings(total_frames=1500, checkpoint_interval_s=0.0), "
    "collector=drone_rl.config.learning.Threads(num_envs=8)"
)
SMALLER = {
    "notebook": {
        "train(seed=1)": f"train(seed=1, {SHORT})",
        "judge(policy)": "judge(policy, episodes=8)",
        "episodes=200": "episodes=8",
        'explain([policy, "poor"], ': "explain([policy], frames=30, episodes=8, perplexity=5, ",
    },
    "returns": {"seed=1)": f"seed=1, {SHORT})"},
    "network": {"seed=1)": f"seed=1, {SHORT})", "episodes=200": "episodes=8"},
    "motion": {
        "100": "10",
        "make_env(64": "make_env(8",
        "total_frames=400_000": "total_frames=2_000",
    },
    "task": {
        "make_env(64": "make_env(8",
        "total_frames=100_000": "total_frames=500",
        "actor, 400": "actor, 20",
    },
    "learner": {
        "make_env(64": "make_env(8",
        "total_frames=200_000": "total_frames=1_500",
        "total_frames=20_000": "total_frames=3_000",
        "total_frames=10_000": "total_frames=1_500",
    },
    "sb3": {
        "num_envs=32": "num_envs=4",
        "n_steps=128, batch_size=512": "n_steps=16, batch_size=64",
        "40_000": "64",
        "episodes=400": "episodes=8",
        'folder="outputs/explain/sb3"': 'folder="sb3", frames=30, episodes=6, perplexity=5',
    },
    "section": {"frames=120": "frames=30, perplexity=5", "make_env(64)": "make_env(30)"},
}
"""What the tests change of a page, and into what."""


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    """A folder as a reader's: modules are found there, and so are files for the package."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    inside = tmp_path / "drone_rl"
    for package in (drone_rl.explanations, report):
        folder = inside.joinpath(*package.__name__.split(".")[1:])
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(folder)])
    few = {name: explain.SECTIONS[name] for name in ("dataset", "evaluation")}
    monkeypatch.setattr(explain, "SECTIONS", few)  # all of them take a minute
    monkeypatch.setattr(report_page, "PARTS", dict(report_page.PARTS))
    known, threads = set(sys.modules), torch.get_num_threads()
    templates = jinja2.FileSystemLoader(inside / "explanations" / "report" / "templates")
    theirs = jinja2.PackageLoader("drone_rl.explanations.report")
    loader = jinja2.ChoiceLoader([theirs, templates])
    monkeypatch.setattr(jinja2, "PackageLoader", lambda _: loader)
    report_page._environment.cache_clear()  # another tutorial may have made it, with another loader
    with patch.dict(TASKS), patch.dict(MAKERS):  # a page's tasks are registered until its end
        yield tmp_path
    report_page._environment.cache_clear()
    torch.set_num_threads(threads)
    for name in set(sys.modules) - known:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]
    kinds_of.cache_clear()  # a tutorial's settings count as variants as long as a cache holds them
    types_of.cache_clear()
    gc.collect()


def read_blocks(page):
    """Language, file name and code of each, with the sizes of the tests."""
    text = page.read_text()
    for large, small in SMALLER.get(page.stem, {}).items():
        assert large in text, f"{page.stem} no longer has {large!r}"
        text = text.replace(large, small)
    return BLOCK.findall(text)


def run(code, where, names):
    """Runs a block as a notebook would: what its last line is worth is shown."""
    tree = ast.parse(code)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, where, "exec"), names)
    if last is not None:
        value = eval(compile(ast.Expression(last.value), where, "eval"), names)
        if hasattr(value, "_repr_html_"):
            assert value._repr_html_().startswith("<")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_it_runs(page, workplace):
    if page.stem == "sb3":
        pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
    names = {"__name__": "__main__"}
    for number, (language, title, code) in enumerate(read_blocks(page)):
        if title:
            (workplace / title).parent.mkdir(parents=True, exist_ok=True)
            (workplace / title).write_text(code)
        elif language == "python":
            run(code, f"{page.stem}, block {number}", names)
        elif language == "sh":
            check_commands(code)


def test_a_minimal_task_takes_at_most_80_lines():
    blocks = BLOCK.findall((DOCS / "tutorials" / "task.md").read_text())
    (post,) = [text for _, title, text in blocks if title == "post.py"]
    assert len(post.splitlines()) <= 80
