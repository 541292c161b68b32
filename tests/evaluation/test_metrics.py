import torch

from drone_rl.evaluation import Episodes, summarise


def test_summary_by_hand():
    summary = summarise(
        Episodes(
            collected=torch.tensor([[True, True], [True, False], [False, False]]),
            side=torch.tensor([[0, 1], [2, 0], [0, -1]]),
            end_reason=torch.tensor([1, 2, 4]),
            length=torch.tensor([10, 20, 60]),
        )
    )
    assert summary["mean_cubes"] == 1.0
    assert summary["all_cubes"]["successes"] == 1
    sides = {k: (v["successes"], v["trials"]) for k, v in summary["by_side"].items()}
    assert sides == {"left": (1, 3), "ahead": (1, 1), "right": (1, 1)}
    assert summary["end_reason"] == {
        "all_cubes": 1,
        "front_boundary": 1,
        "side_boundary": 0,
        "step_limit": 1,
    }
    assert (summary["mean_length"], summary["max_length"]) == (30.0, 60)
