"""The table of learners of this and other libraries."""

from tools.readme.peers import make_peers
from tools.readme.tables import UNKNOWN


def test_every_learner_has_a_row():
    ours = {
        "seconds": [9.04, 10.0],
        "seconds_without_imports": [5.0, 6.0],
        "frames": [12_000, 9_000],
        "is_solved": [True, True],
        "success_lower95": [0.996, 0.98],
    }
    table = make_peers({"peers": {"ppo": ours, "torchrl": {**ours, "is_solved": [False, True]}}})
    lines = {line.split(" | ")[0]: line for line in table.splitlines()[2:]}
    assert len(lines) == 6
    assert lines["| drone_rl, PPO"].endswith(
        "| 9.0; 10.0 | 5.0; 6.0 | 12,000; 9,000 | 99.6%; 98.0% |"
    )
    assert "12,000; 9,000 (1 not solved)" in lines["| TorchRL's Collector, REINFORCE"]
    assert "num_envs 32, steps 150, lr 0.003" in lines["| TorchRL's Collector, REINFORCE"]
    assert lines["| Stable-Baselines3, A2C"].count(UNKNOWN) == 4
