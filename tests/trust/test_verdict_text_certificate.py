"""What is said of a certificate, word by word."""

import pytest

from drone_rl.trust.verdict_text import PROOF, is_proved, is_quoted
from drone_rl.utils.text import said
from tests.evidence import PROOF as QUOTED


def speak(num_cubes=3, **changed):
    return said(PROOF, {"num_cubes": num_cubes, "proof": {**QUOTED, **changed}})


def test_every_placement():
    assert speak(agreeing=1000) == {
        "proof.every": "A certificate states for every placement: with its most probable actions "
        "it collects all 3 cubes from all places where they may stand.",
        "proof.basis": "The certificate is of this network and task, and its boxes are a partition "
        "of the placements. It was re-checked by 1,000 rollouts from fresh placements, seed 17: "
        "all ended as it states, so that with 95% confidence it is wrong about at most 0.31% of "
        "the placements (to prove it again, run drone-rl prove). All 1,000 greedy episodes of "
        "this verdict whose end it states ended that way.",
    }
    assert "collects the cube from" in speak(1)["proof.every"]


def test_the_exact_share():
    lost = speak(1, every=False, share=0.6375, lost=0.3625)
    assert lost["proof.share"] == (
        "A certificate states: with its most probable actions it collects the cube from "
        "63.75% of all placements; from 36.25% it does not."
    )
    assert "proof.every" not in lost
    some = speak(every=False, share=0.5, lost=0.25, undecided=0.25, finished=False)
    assert some["proof.share"] == (
        "A certificate states so far, for the proof was stopped: with its most probable actions "
        "it collects all 3 cubes from 50% of all placements; from 25% it "
        "does not, and 25% is undecided."
    )


@pytest.mark.parametrize("share", [1 - 1e-12, 1.0])
def test_nearly_all_is_never_all(share):
    text = speak(every=False, share=share, undecided=1e-12)["proof.share"]
    assert "from more than 99.9999999% of all" in text
    assert "from 0% it does not, and 1e-10% is undecided" in text


def test_all_is_said_to_be_all():
    text = speak(every=False, share=0.0, lost=1.0)["proof.share"]
    assert "from 0% of all placements; from 100% it does not." in text
    text = speak(every=False, share=0.0, undecided=1.0, finished=False)["proof.share"]
    assert "from 0% it does not, and 100% is undecided." in text
    text = speak(every=False, share=1e-12, lost=1.0)["proof.share"]
    assert "from more than 99.9999999% it does not" in text
    text = speak(every=False, lost=1e-12, share=0.0, undecided=1.0)["proof.share"]
    assert "and more than 99.9999999% is undecided" in text


def test_what_was_not_re_checked_or_too_little_is_no_proof():
    unchecked = {"checked": 0, "wrong_at_most": None, "agreeing": 0}
    basis = speak(**unchecked)["proof.basis"]
    assert basis.endswith(
        "It was read from its file and not re-checked, so it proves nothing here."
    )
    few = {"checked": 100, "wrong_at_most": 0.031, "seed_is_fixed": True, "agreeing": 0}
    basis = speak(**few)["proof.basis"]
    assert "re-checked by 100 rollouts from placements of the fixed seed 17, to which a" in basis
    assert basis.endswith(
        "wrong about at most 3.1% of the placements, which is too much for a proof."
    )
    for changed in (unchecked, few, {"wrong_at_most": 0.0101}):
        assert not is_proved({"proof": {**QUOTED, **changed}})
    assert is_proved({"proof": {**QUOTED, "wrong_at_most": 0.01}})
    before = {key: value for key, value in QUOTED.items() if key != "wrong_at_most"}
    assert not is_proved({"proof": before})


def test_what_is_refused_is_not_quoted():
    found = said(PROOF, {"num_cubes": 3, "proof": {"refused": "it is of another network"}})
    assert found == {"proof.refused": "A certificate is not quoted: it is of another network."}


@pytest.mark.parametrize("evidence", [{}, {"proof": None}])
def test_without_a_certificate_nothing_is_said(evidence):
    assert not is_quoted(evidence) and not is_proved(evidence)
    assert said(PROOF, evidence) == {}


def test_a_policy_is_proved_if_what_is_quoted_says_so_of_every_placement():
    assert is_proved({"proof": QUOTED})
    assert not is_proved({"proof": {**QUOTED, "every": False}})
    assert not is_proved({"proof": {"refused": "it is of another network"}})
