"""A card shows the figures of the verdict, by hand."""

from drone_rl.trust.export import write_card
from tests.trust.test_export_card_text import CARD, VERDICT


def lines(**changed):
    return write_card("mine", "0123", {**CARD, **changed}).splitlines()


def test_a_card_names_policy_verdict_origin_and_digest():
    found = lines()
    assert found[0] == "# mine"
    assert found[2].startswith("**poor** (certain")
    assert any("`drone-rl train seed=7` for 12,345 frames" in line for line in found)
    assert "- SHA-256 of `mine.safetensors`: `0123`" in found
    assert "- revision abc; torch 1, torchrl 2, mujoco-warp 3" in found


def test_flights_stand_side_by_side_with_the_best_luck_and_the_oracle():
    found = lines()
    head = "|  | most probable actions | sampled actions | best blind baseline (forward) | oracle |"
    assert head in found
    row = found[found.index(head) + 3]
    assert row.startswith("| cubes collected | 90.0% (80.0 to 100.0) | 60.0% (")
    assert "| 30.0% (" in row and "| 100.0% (" in row


def test_a_side_without_cubes_is_not_offered():
    (left,) = (line for line in lines() if line.startswith("| of those left"))
    assert left == "| of those left | not offered | not offered | not offered | not offered |"


def test_greedy_flights_alone_have_no_column_of_drawn_ones():
    assert "sampled actions" not in "\n".join(lines(verdict={**VERDICT, "sampled": None})[4:6])


def test_the_largest_failure_comes_first_and_those_that_never_happened_are_left_out():
    found = lines()
    at = found.index("| fails first at | episodes | of | rate |")
    assert found[at + 2] == "| cube: first | 31 | 400 | 75.0% (70.0 to 80.0) |"
    assert found[at + 3].startswith("| end: step_limit | 4 | 400 |")
    assert found[at + 4] == ""


def test_a_policy_that_never_failed_has_a_bound():
    bound = {"share": 0.0, "lower95": 0.0, "upper95": 0.009, "trials": 400}
    failures = {"rows": [], "largest": None, "bound": bound}
    found = "\n".join(lines(verdict={**VERDICT, "failures": failures}))
    assert "| fails | never |" in found
    assert "less than 1%" not in found
    assert "| upper bound | 0.9% of episodes |" in found


def test_a_package_that_is_not_noted_is_unknown():
    found = lines(provenance={"versions": {"torch": "1"}, "git_revision": None})
    assert "- revision unknown; torch 1, torchrl unknown, mujoco-warp unknown" in found


def test_a_small_bound_is_not_zero():
    bound = {"share": 0.0, "lower95": 0.0, "upper95": 0.000369, "trials": 10_000}
    failures = {"rows": [], "largest": None, "bound": bound}
    found = "\n".join(lines(verdict={**VERDICT, "failures": failures}))
    assert "| upper bound | <0.1% of episodes |" in found


def test_an_unknown_command_is_not_named():
    found = "\n".join(lines(command=None))
    assert "- Trained for 12,345 frames; the file's metadata" in found
