"""`drone-rl explain` and `report`."""

from pathlib import Path

import drone_rl
from drone_rl.explanations.explain import Explanations
from drone_rl.utils.seeding import RootSeed
from tests.explanations.example import changed_explanation
from tests.explanations.quick import few_sections, quick_figures


def test_explain_then_report(in_process, tmp_path):
    few = ["frames=30", "episodes=8", "perplexity=5", "num_envs=32"]
    with few_sections("dataset", "verdict"), quick_figures():
        done = in_process("explain", "policy=poor", "require=good", *few, "hydra.run.dir=run")
        again = in_process("report", "explanations=run", "hydra.run.dir=again")
    assert "poor: poor" in done.stdout
    assert done.returncode == 13  # poor, but 8 episodes are too few to be certain
    first = (tmp_path / "run" / "report.html").read_text()
    assert again.returncode == 0, again.stderr
    assert (tmp_path / "again" / "report.html").read_text() == first


def test_several_policies_are_explained_together(in_process, monkeypatch):
    kinds = {"good": ("good", 0), "poor": ("poor", 13)}
    seen = {}

    def explain(policies, settings, **kwargs):
        seen.update(names=[policy.name for policy in policies], frames=settings.frames, **kwargs)
        explained = {
            name: changed_explanation(
                {
                    "verdict.kind": kind,
                    "verdict.exit_code": code,
                }
            )
            for name, (kind, code) in kinds.items()
        }
        return Explanations(Path("x"), Path("x/report.html"), explained, RootSeed(1, is_fixed=True))

    monkeypatch.setattr(drone_rl, "explain", explain)
    done = in_process("explain", "policy=[good,poor]", "frames=150", "num_envs=7")
    assert (done.returncode, seen["names"]) == (0, ["good", "poor"])
    assert (seen["frames"], seen["num_envs"]) == (150, 7)
    assert "good: good: This policy" in done.stdout and "poor: poor: This policy" in done.stdout
    assert in_process("explain", "policy=[good,poor]", "require=good").returncode == 13
