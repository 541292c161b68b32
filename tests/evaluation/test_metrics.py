import pytest
import torch

from drone_rl.evaluation import Episodes, proportion, summarise


def test_clopper_pearson_by_known_values():
    # the rule of three's exact form: no failure in n gives a lower end of (alpha/2)^(1/n)
    result = proportion(1000, 1000)
    assert result["lower95"] == pytest.approx(0.025 ** (1 / 1000))
    assert result["upper95"] == 1.0
    five = proportion(5, 10)
    assert (five["lower95"], five["upper95"]) == pytest.approx((0.1871, 0.8129), abs=1e-4)
    none = proportion(0, 10)
    assert (none["lower95"], none["upper95"]) == pytest.approx((0.0, 0.3085), abs=1e-4)


def test_share_of_nothing_is_unknown():
    result = proportion(0, 0)
    assert result["share"] is None
    assert (result["lower95"], result["upper95"]) == (0.0, 1.0)


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
