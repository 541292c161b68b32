"""The comparison of measured with right numbers, and how many programs there are."""

from benchmarks.airsim_programs.program import Near, Program, mistakes


def test_wrong_missing_and_unchecked_numbers_are_listed():
    right = {"x": Near([1.0, 2.0], 0.1), "name": {"airsim": "a", "cosysairsim": "b"}}
    one = Program(lambda s: {}, right, ("airsim", "cosysairsim"), "{}", {})
    assert mistakes(one, "airsim", {"x": [1.05, 1.95], "name": "a"}) == []
    assert len(mistakes(one, "cosysairsim", {"x": [1.05, 1.95], "name": "a"})) == 1
    assert len(mistakes(one, "airsim", {"x": [1.0, 2.2], "name": "a"})) == 1
    assert len(mistakes(one, "airsim", {"x": [1.0, float("nan")], "name": "a"})) == 1
    assert len(mistakes(one, "airsim", {"name": "a", "y": 3})) == 2
