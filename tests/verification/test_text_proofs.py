"""The describe_proof of a certificate says what the certificate says."""

import pytest

from drone_rl.verification.text import describe_proof, describe_round


def certificate(won=1.0, undecided=0.0, finished=True, cubes=3):
    outcomes = [{"end": "all_cubes", "share": won}] if won else []
    if won + undecided < 1:
        outcomes.append({"end": "front_boundary", "share": 1 - won - undecided})
    return {
        "policy": {"description": {"task": {"num_cubes": cubes}}},
        "outcomes": outcomes,
        "undecided": {"share": undecided, "boxes": [[[0, 1]]] if undecided else []},
        "finished": finished,
        "found": {},
    }


def test_all_placements():
    assert (
        describe_proof(certificate())
        == "Proved: with its most probable actions it collects all 3 cubes from every placement."
    )
    assert "the cube from every" in describe_proof(certificate(cubes=1))


def test_a_certificate_without_statements_proves_nothing():
    empty = {**certificate(), "outcomes": []}
    assert "every placement" not in describe_proof(empty)


@pytest.mark.parametrize("undecided", [0.5, 1e-12])
def test_what_is_undecided_is_never_proved(undecided):
    text = describe_proof(certificate(won=1 - undecided, undecided=undecided))
    assert "every placement" not in text
    assert f"{100 * undecided:.9g}% are undecided" in text


def test_shares():
    text = describe_proof(certificate(won=0.75))
    assert "collects all 3 cubes from 75% of all placements; from 25% it does not." in text


def test_a_proof_that_was_stopped():
    text = describe_proof(certificate(won=0.25, undecided=0.75, finished=False))
    assert text.endswith("so far (the proof was stopped).")


def test_what_helps_a_proof_of_too_many_boxes():
    stopped = certificate(won=0.25, undecided=0.75, finished=False)
    stopped["found"]["stopped_by"] = "most_boxes"
    assert "stopped at most_boxes open boxes" in describe_proof(stopped)
    assert "with a smaller most_combinations" in describe_proof(stopped)
    stopped["found"]["stopped_by"] = "limit_s"
    assert describe_proof(stopped).endswith("so far (the proof was stopped).")


def test_nearly_all_is_never_all_and_all_is():
    nearly = describe_proof(certificate(won=1 - 1e-12, undecided=1e-12))
    assert "from more than 99.9999999% of all placements" in nearly
    assert "; from 100% it does not." in describe_proof(certificate(won=0.0))
    lost = describe_proof(certificate(won=1e-12))
    assert "from 1e-10% of all placements" in lost
    assert "from more than 99.9999999% it does not." in lost
    stopped = describe_proof(certificate(won=0.0, undecided=1.0, finished=False))
    assert "from 0% it does not, and 100% are undecided so far" in stopped
    begun = describe_proof(certificate(won=1e-12, undecided=1 - 1e-12, finished=False))
    assert "more than 99.9999999% are undecided so far" in begun


def test_what_a_training_found():
    search = {"frames": 20_000, "failures": 3, "flights": 4000, "losing": None}
    assert describe_round(search) == "at frame 20,000: 3 of 4,000 episodes failed"
    proof = {"losing": 0.25, "undecided": 1e-7, "proof_s": 61.6}
    assert describe_round(search | proof) == (
        "at frame 20,000: 3 of 4,000 episodes failed; proof in 62 s: fails from 25% of all "
        "placements, 1e-05% undecided"
    )
