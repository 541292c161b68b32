"""Each sentence of a verdict, and the change of evidence that takes or turns it."""

import pytest

from drone_rl.trust.verdict_text import PROOF, SENTENCES, is_proved, is_quoted
from drone_rl.utils.text import said
from tests.evidence import PROOF as QUOTED


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


def test_sentences_of_a_good_policy(evidence):
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
def test_sentence_of_each_kind(evidence, kind, part):
    evidence["kind"] = kind
    assert part in speak(evidence)["kind"]
    evidence["certain"] = False
    assert "kind" not in speak(evidence)
    assert speak(evidence)["open"].startswith("This policy looks ")


def test_sentences_of_a_trivial_task(evidence):
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
def test_sentence_of_the_largest_failure(evidence, largest, text):
    evidence["failures"]["largest"] = largest
    assert text in speak(evidence)["failures.largest"]


def test_sentence_without_failures_has_a_bound(evidence):
    evidence["failures"]["largest"] = None
    assert "failures.never" not in speak(evidence)  # 24 failed, of no class in the table
    evidence["failures"]["bound"]["successes"] = 0
    found = speak(evidence)
    assert found["failures.never"] == (
        "It failed in none of 400 episodes, so it fails in at most 9.2% (95% CI)."
    )
    assert "failures.largest" not in found


def speak_of_proof(num_cubes=3, **changed):
    return said(PROOF, {"num_cubes": num_cubes, "proof": {**QUOTED, **changed}})


def test_sentences_of_a_certificate_of_every_placement():
    assert speak_of_proof(agreeing=1000) == {
        "proof.every": "A certificate states for every placement: with its most probable actions "
        "it collects all 3 cubes from all places where they may stand.",
        "proof.basis": "The certificate is of this network and task, and its boxes are a partition "
        "of the placements. It was re-checked by 1,000 rollouts from fresh placements, seed 17: "
        "all ended as it states, so that with 95% confidence it is wrong about at most 0.31% of "
        "the placements (to prove it again, run drone-rl prove). All 1,000 greedy episodes of "
        "this verdict whose end it states ended that way.",
    }
    assert "collects the cube from" in speak_of_proof(1)["proof.every"]


@pytest.mark.parametrize("share", [1 - 1e-12, 1.0])
def test_nearly_all_placements_are_not_all(share):
    text = speak_of_proof(every=False, share=share, undecided=1e-12)["proof.share"]
    assert "from more than 99.9999999% of all" in text
    assert "from 0% it does not, and 1e-10% is undecided" in text


def test_certificates_without_enough_rollouts_prove_nothing():
    unchecked = {"checked": 0, "wrong_at_most": None, "agreeing": 0}
    basis = speak_of_proof(**unchecked)["proof.basis"]
    assert basis.endswith(
        "It was read from its file and not re-checked, so it proves nothing here."
    )
    few = {"checked": 100, "wrong_at_most": 0.031, "seed_is_fixed": True, "agreeing": 0}
    basis = speak_of_proof(**few)["proof.basis"]
    assert "re-checked by 100 rollouts from placements of the fixed seed 17, to which a" in basis
    assert basis.endswith(
        "wrong about at most 3.1% of the placements, which is too much for a proof."
    )
    for changed in (unchecked, few, {"wrong_at_most": 0.0101}):
        assert not is_proved({"proof": {**QUOTED, **changed}})
    assert is_proved({"proof": {**QUOTED, "wrong_at_most": 0.01}})
    before = {key: value for key, value in QUOTED.items() if key != "wrong_at_most"}
    assert not is_proved({"proof": before})


@pytest.mark.parametrize("evidence", [{}, {"proof": None}])
def test_without_a_certificate_nothing_is_said(evidence):
    assert not is_quoted(evidence) and not is_proved(evidence)
    assert said(PROOF, evidence) == {}


def test_a_policy_is_proved_if_what_is_quoted_says_so_of_every_placement():
    assert is_proved({"proof": QUOTED})
    assert not is_proved({"proof": {**QUOTED, "every": False}})
    assert not is_proved({"proof": {"refused": "it is of another network"}})
