"""Each sentence of a verdict, and the change of evidence that takes or turns it."""

import copy

import pytest

from drone_rl.trust.verdict_text import SENTENCES, quantity_label
from drone_rl.utils.text import said


def share(value, **more):
    return {"share": value, "lower95": value - 0.01, "upper95": value + 0.01, **more}


def flights(success, left, ahead, right, everything):
    values = {"all": everything, "left": left, "ahead": ahead, "right": right}
    shares = {k: {"mean": v, "count": 0 if v is None else 400} for k, v in values.items()}
    return {"episodes": 400, "success": share(success), "shares": shares}


def row(by, value, failed, episodes=400, **more):
    low = {"lower95": failed / episodes - 0.02}
    of = {"episodes": episodes, "failed": failed, "share": failed / episodes}
    return {"by": by, "value": value, **of, **low, **more}


@pytest.fixture
def evidence():
    """A good policy that misses some cubes on its left."""
    largest = row("side", "left", 30, 300)
    ends = [row("end", "front_boundary", 30), row("end", "step_limit", 0)]
    return {
        "kind": "good",
        "seed": 0,
        "seed_is_fixed": True,
        "certain": True,
        "good_share": 0.9,
        "enough": 400,
        "greedy": flights(0.94, 0.9, 1.0, 1.0, 0.96),
        "sampled": flights(0.5, 0.5, 0.5, 0.5, 0.5),
        "drawing": {"lower95": -0.1, "upper95": 0.1},
        "baselines": {
            "random": flights(0.03, 0.2, 0.4, 0.2, 0.28),
            "forward": flights(0.02, 0.0, 1.0, 0.0, 0.27),
            "left": flights(0.0, 0.0, 0.0, 0.0, 0.0),
            "right": flights(0.0, 0.0, 0.0, 0.0, 0.0),
            "oracle": flights(1.0, 1.0, 1.0, 1.0, 1.0),
        },
        "failures": {
            "rows": [largest, *ends],
            "largest": largest,
            "expected_end": "front_boundary",
            "bound": {"share": 0.06, "successes": 24, "upper95": 0.0921, "trials": 400},
        },
    }


def speak(evidence):
    return said(SENTENCES, evidence)


def test_what_is_said_of_a_good_policy(evidence):
    assert speak(evidence) == {
        "kind": "This policy does its task: it collects every cube in 94.0% of episodes.",
        "fixed_seed": "Fixed seed 0: a policy could have been fitted to these environments.",
        "shares": "It collects 90.0% of the cubes on its left, 100% of those ahead and 100% of "
        "those on its right.",
        "baselines": "From the same initial states it collects 96.0% of all cubes, acting at "
        "random 28.0% and the oracle 100%.",
        "failures.largest": "It fails most with cubes on its left: in 30 of 300 episodes that "
        "offered one (10.0%).",
    }


@pytest.mark.parametrize(
    ("kind", "part"),
    [
        ("poor", "does not do its task: it is hardly better than acting at random."),
        ("one-sided (right)", "can't be trusted with cubes on its left: it collects every cube"),
        ("one-sided (left)", "can't be trusted with cubes on its right"),
        ("none of these", "is neither good nor poor nor one-sided: it collects"),
        ("good, but trivial", " is good by this rule, too: it collects every cube in "),
    ],
)
def test_kinds(evidence, kind, part):
    evidence["kind"] = kind
    assert part in speak(evidence)["kind"]
    evidence["certain"] = False
    assert "kind" not in speak(evidence)
    assert speak(evidence)["open"].startswith("This policy looks ")


def test_poor_is_compared_with_luck(evidence):
    evidence["kind"] = "poor"
    evidence["greedy"]["shares"]["all"]["mean"] = 0.28
    assert speak(evidence)["kind"].endswith("it is no better than acting at random.")


def test_uncertain_says_how_many_episodes_would_do(evidence):
    evidence |= {"certain": False, "enough": 2000}
    assert (
        "looks good, but 400 episodes are too few to be certain (about 2,000 would do)"
        in (speak(evidence)["open"])
    )
    evidence["enough"] = None
    assert "(many times as many might not do)" in speak(evidence)["open"]


def test_sides(evidence):
    shares = evidence["greedy"]["shares"]
    shares["left"] = shares["right"] = {"mean": None, "count": 0}
    assert speak(evidence)["shares"] == (
        "It collects 100% of the cubes ahead; none were offered on its left or on its right."
    )
    for side in ("left", "ahead", "right"):
        shares[side] = {"mean": 1.0, "count": 10}
    assert "shares" not in speak(evidence)  # nothing to tell
    for side in ("left", "ahead", "right"):
        shares[side] = {"mean": None, "count": 0}
    assert speak(evidence)["shares"] == (
        "No cubes were offered on its left, ahead or on its right."
    )


def test_luck_that_is_enough(evidence):
    evidence["baselines"]["forward"] = flights(0.9, None, 1.0, None, 1.0)
    found = speak(evidence)
    assert found["pointless"] == (
        "This task is trivial: flying straight on collects every cube in 90.0% of episodes."
    )
    assert "baselines" not in found
    evidence["kind"] = "good, but trivial"
    found = speak(evidence)
    assert found["kind"] == (
        "Flying straight on does as well: it collects every cube in 90.0% of episodes, this policy "
        "in 94.0%."
    )
    assert "pointless" not in found
    evidence["baselines"]["forward"] = flights(0.89, None, 1.0, None, 1.0)
    found = speak(evidence)
    assert "pointless" not in found
    assert "flying straight on 100%" in found["baselines"]


def test_a_task_that_nobody_can_do(evidence):
    assert "hopeless" not in speak(evidence)
    evidence["baselines"]["oracle"]["success"] = share(0.48)
    assert "in only 48.0% of episodes" in speak(evidence)["hopeless"]
    evidence["baselines"]["oracle"]["success"] = share(0.495)
    assert "hopeless" not in speak(evidence)


@pytest.mark.parametrize(
    ("largest", "text"),
    [
        (row("cube", "first", 40), "at the first cube: in 40 of 400 episodes (10.0%)."),
        (row("cube", "third", 9, 90), "third cube: in 9 of 90 episodes that got so far (10.0%)."),
        (row("cube", "third", 400), "at the third cube: in all 400 episodes."),
        (row("sideways", "4 to 6 m", 9, 90), "with cubes 4 to 6 m to its side: in 9 of 90"),
        (row("height", "higher", 9, 90), "with cubes higher than its start: in 9 of 90 episodes"),
        (row("side", "ahead", 90, 90), "with cubes ahead: in all 90 episodes that offered one."),
        (row("end", "step_limit", 40), "at the step limit: in 40 of 400 episodes (10.0%)."),
    ],
)
def test_the_largest_failure(evidence, largest, text):
    evidence["failures"]["largest"] = largest
    assert text in speak(evidence)["failures.largest"]


def test_how_many_episodes_end(evidence):
    rows, largest = evidence["failures"]["rows"], evidence["failures"]["largest"]
    rows[2] = row("end", "step_limit", 120)
    rows.append(row("cube", "second", 200))  # no end
    said = speak(evidence)["failures.largest"]
    assert said.endswith("(10.0%); 30.0% of all end at the step limit.")
    rows[2] = row("end", "step_limit", 16)  # at least 2% are not sure
    assert "step limit" not in speak(evidence)["failures.largest"]
    rows[1] = row("end", "front_boundary", 400)  # who missed a cube ends there
    assert "behind the last cube" not in speak(evidence)["failures.largest"]
    largest |= row("end", "step_limit", 120)
    rows[2] = copy.copy(largest)
    assert speak(evidence)["failures.largest"].count("step limit") == 1


def test_no_failure_has_a_bound(evidence):
    evidence["failures"]["largest"] = None
    assert "failures.never" not in speak(evidence)  # 24 failed, of no class in the table
    evidence["failures"]["bound"]["successes"] = 0
    found = speak(evidence)
    assert found["failures.never"] == (
        "It failed in none of 400 episodes, so it fails in at most 9.2% (95% CI)."
    )
    assert "failures.largest" not in found


def test_drawn_actions_that_differ_beyond_doubt(evidence):
    for bounds in ((0.01, 0.1), (-0.5, -0.01)):
        evidence["drawing"] = dict(zip(("lower95", "upper95"), bounds, strict=True))
        assert "every cube in 50.0% of episodes, not in 94.0%" in speak(evidence)["drawing"]
    evidence["drawing"] = None
    assert "drawing" not in speak(evidence)


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("success", "success rate above 90% of the oracle's (margin, good if above 0)"),
        ("offered left", "episodes that offer cubes left (fraction)"),
        ("collected ahead", "cubes collected ahead (fraction)"),
        (
            "above forward",
            "cubes collected beyond a sixth of the way from forward to the oracle (margin)",
        ),
        (
            "unsolved by random",
            "90% of the oracle's success rate above that of random (margin, trivial if not above "
            "0)",
        ),
    ],
)
def test_quantities_have_labels_for_people(evidence, name, label):
    assert quantity_label(name, {**evidence, "good_share": 0.9}) == label


def test_every_sentence_has_its_condition_in_words():
    assert all(sentence.condition and sentence.name for sentence in SENTENCES)
    assert len({sentence.name for sentence in SENTENCES}) == len(SENTENCES)


def test_another_way_of_moving_is_told(evidence):
    assert "unlike" not in speak(evidence)
    mode = {"own": "computer_vision", "flown": "simple_flight"}
    wind = {"own": [0.0, 0.0, 0.0], "flown": [5.0, 0.0, 0.0]}
    evidence["unlike"] = {"mode": mode, "wind": wind}
    assert speak(evidence)["unlike"] == (
        "It was trained with other dynamics: here it flew with dynamics.mode=simple_flight "
        "instead of computer_vision and dynamics.wind=[5, 0, 0] instead of [0, 0, 0]."
    )
    evidence["unlike"] = {}
    assert "unlike" not in speak(evidence)


def test_a_verdict_says_where_effects_of_rounding_have_no_bound(evidence):
    found = {"arithmetic": "float32 on cpu, PyTorch", "decides": False}
    for bound, more in ((True, "."), (False, "; effects of rounding were estimated, not bounded.")):
        text = speak({**evidence, "rounding": {**found, "bound": bound}})["arithmetic"]
        assert text == f"The verdict holds for float32 on cpu, PyTorch{more}"


def test_without_a_bound_unexplained_differences_may_be_of_outcomes_only(evidence):
    found = {
        "arithmetic": "float32 on cpu, PyTorch",
        "decides": True,
        "frames": 9000,
        "fragile": 90,
        "fragile_rate": 0.01,
        "episodes": 400,
        "fragile_episodes": 4,
        "compared": "fused kernel",
        "compared_episodes": 50,
        "unexplained": 3,
    }
    evidence["certain"] = False
    for bound, what in ((True, "took other actions"), (False, "gave other results")):
        text = speak({**evidence, "rounding": {**found, "bound": bound}})["rounding"]
        assert text.endswith(f"fused kernel {what} in 3 of 50 episodes for no such reason.")


def test_a_baseline_that_only_a_weak_oracle_makes_good_does_not_do_as_well(evidence):
    evidence["kind"] = "good, but trivial"
    evidence["baselines"]["forward"] = flights(0.6, None, 1.0, None, 0.8)
    evidence["baselines"]["oracle"] = flights(0.4, 0.5, 0.5, 0.5, 0.5)
    assert speak(evidence)["kind"].startswith("Flying straight on is good by this rule, too: ")
