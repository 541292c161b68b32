"""A policy that goes out can be judged like those that came."""

import pytest

from tests.cli.running import error_line


def test_an_export_can_be_judged(in_process, tmp_path):
    done = in_process("export", "policy=good", "name=mine", "episodes=20", "hydra.run.dir=e")
    assert done.returncode == 0, done.stderr
    assert "drone-rl train" in (tmp_path / "e" / "mine.md").read_text()
    assert done.stdout.startswith("good (not certain): This policy")
    done = in_process("verdict", "policy=e/mine.safetensors", "episodes=20", "hydra.run.dir=v")
    assert done.returncode == 13, done.stderr  # as good as can be, but 20 episodes prove nothing
    assert done.stdout.startswith("good (not certain): ")


def test_an_export_for_other_programs(in_process, tmp_path, monkeypatch):
    monkeypatch.setattr("drone_rl.trust.onnx_export._STEPS", 5)  # a few images suffice here
    done = in_process("export", "policy=poor", "name=mine", "format=onnx", "hydra.run.dir=e")
    assert done.returncode == 0, done.stderr
    assert {path.name for path in (tmp_path / "e").iterdir()} == {".hydra", "mine.onnx"}
    assert done.stdout.startswith("recorded verdict: poor 0.0% (0.0 to ")


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (["export", "policy=good", "format=pickle"], ["format='pickle'", "safetensors, onnx"]),
        (
            ["export", "policy=proved", "format=onnx", "certificate=c.json"],
            ["certificate", "format=safetensors"],
        ),
        (["export", "policy=none.pt", "name=../x"], ["name='../x'", "without /"]),
        (["export", "policy=good", "name=mine.onnx"], ["has an extension", "name=mine"]),
        (["export", "policy=none.pt", "name=a/b"], ["name='a/b'", "without /"]),
        (["export", "policy=good", "episodes=0"], ["episodes=0", "1 or more"]),
    ],
)
def test_mistakes_get_one_line(in_process, command, words):
    line = error_line(in_process(*command))
    assert all(word in line for word in words), line
