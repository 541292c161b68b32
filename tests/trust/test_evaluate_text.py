from drone_rl.trust.evaluate import EVALUATION
from drone_rl.utils.text import say

FRESH = {"seed": 5, "seed_is_fixed": False}
FOUND = {
    "arithmetic": "float32 on cpu, PyTorch",
    "frames": 2000,
    "fragile": 400,
    "fragile_rate": 0.2,
    "threshold": 0.1,
    "fragile_episodes_rate": 0.5,
    "threshold_episodes": 0.6,
    "compared": "fused kernel",
    "compared_episodes": 50,
    "differing": 0,
}


def said(**changes):
    return say(EVALUATION, {**FRESH, "rounding": {**FOUND, **changes}})


def test_an_evaluation_that_depends_on_rounding_says_so_even_if_both_implementations_agree():
    assert said().endswith(
        "when computed again (fused kernel). These figures hold for this arithmetic only: in 400 "
        "of 2,000 of these episodes' frames (20.0%) the order in which float32 sums are computed "
        "can change the action."
    )


def test_few_frames_and_other_differences_are_not_called_fragile():
    few = {"fragile": 20, "fragile_rate": 0.01}
    for changes in (few, {**few, "differing": 9, "unexplained": 9, "excessive": True}):
        assert "only" not in said(**changes)
    assert "in 20 of 2,000" in said(**few, fragile_episodes_rate=0.7)
    assert "decisions depend on rounding" in said(fragile=0, differing=9)


def test_without_a_bound_the_comparison_may_be_of_outcomes_only():
    assert "All actions of the first 50 greedy episodes were the same" in said(bound=True)
    assert "The outcomes of the first 50 greedy episodes were the same" in said(bound=False)
    assert " Actions differed in 9 of " in said(bound=True, differing=9)
    assert " Actions or outcomes differed in 9 of " in said(bound=False, differing=9)
