"""`drone-rl evaluate`, `play`, `shifts`, `bodies` and `export` on policy files."""

import json
import types


def test_evaluate_writes_table_json_and_videos(run, in_process):
    args = ["evaluate", f"policy={run}", "episodes=5", "videos=1", "hydra.run.dir=evaluation"]
    done = in_process(*args, cwd=run)
    assert done.returncode == 0, done.stderr
    assert "all cubes" in done.stdout
    assert "oracle" in done.stdout
    report = json.loads((run / "evaluation" / "evaluation.json").read_text())
    assert report["oracle"]["mean_goals"] == 1.0
    assert report["greedy"]["episodes"] == report["sampled"]["episodes"] == 5
    assert {p.suffix for p in (run / "evaluation" / "videos").iterdir()} == {".mp4", ".gif"}


def test_play_films(run, in_process):
    args = ["play", f"policy={run}", "episodes=1", "appearance=blocks", "hydra.run.dir=films"]
    done = in_process(*args, cwd=run)
    assert done.returncode == 0, done.stderr
    assert {p.name for p in (run / "films").glob("episode_0.*")} == {
        "episode_0.mp4",
        "episode_0.gif",
    }


def test_shifts_of_one_axis(in_process, tmp_path):
    few = ("axes=dead_rows", "strengths=[5]", "modes=[constant]", "episodes=10", "domain=false")
    done = in_process("shifts", "policy=poor", *few, "hydra.run.dir=s")
    assert done.returncode == 0, done.stderr
    assert "dead rows" in done.stdout and "12: " in done.stdout
    kept = json.loads((tmp_path / "s" / "shifts.json").read_text())
    assert kept["axes"]["dead_rows"]["levels"][0]["number"] == 5
    assert {path.name for path in (tmp_path / "s").glob("*.png")} == {"shifts.png", "strips.png"}


def test_bodies_writes_a_table_and_files(in_process, tmp_path):
    few = ("episodes=3", "bodies=[computer vision,simple flight]", "num_envs=3")
    done = in_process("bodies", "policies=[good]", *few, "hydra.run.dir=b")
    assert done.returncode == 0, done.stderr
    head, row = done.stdout.splitlines()[:2]
    assert head.split() == ["computer", "vision", "simple", "flight"]
    assert row.startswith("good")
    kept = json.loads((tmp_path / "b" / "bodies.json").read_text())
    assert kept["bodies"] == ["computer vision", "simple flight"]
    assert {p.suffix for p in (tmp_path / "b").glob("bodies.*")} == {".json", ".png", ".svg"}


def test_an_export_can_be_judged(in_process, tmp_path):
    done = in_process("export", "policy=good", "name=mine", "episodes=20", "hydra.run.dir=e")
    assert done.returncode == 0, done.stderr
    assert "drone-rl train" in (tmp_path / "e" / "mine.md").read_text()
    assert done.stdout.startswith("good (not certain): This policy")
    done = in_process("verdict", "policy=e/mine.safetensors", "episodes=20", "hydra.run.dir=v")
    assert done.returncode == 13, done.stderr  # as good as can be, but 20 episodes prove nothing
    assert done.stdout.startswith("good (not certain): ")


def test_an_export_for_other_programs(in_process, tmp_path, monkeypatch):
    def export(policy, target, **options):
        target.touch()
        return types.SimpleNamespace(difference=0.0, frames=1)

    monkeypatch.setattr("drone_rl.trust.onnx_export.export_onnx", export)
    done = in_process("export", "policy=poor", "name=mine", "format=onnx", "hydra.run.dir=e")
    assert done.returncode == 0, done.stderr
    assert {path.name for path in (tmp_path / "e").iterdir()} == {".hydra", "mine.onnx"}
    assert done.stdout.startswith("differs from PyTorch by at most ")
