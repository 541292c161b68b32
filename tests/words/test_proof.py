"""The sentence of a certificate says what the certificate says."""

import pytest

from drone_rl.words.proof import sentence


def certificate(won=1.0, undecided=0.0, finished=True, cubes=3):
    outcomes = [{"end": "all_cubes", "share": won}] if won else []
    if won + undecided < 1:
        outcomes.append({"end": "front_boundary", "share": 1 - won - undecided})
    return {
        "policy": {"description": {"task": {"num_cubes": cubes}}},
        "outcomes": outcomes,
        "undecided": {"share": undecided, "boxes": [[[0, 1]]] if undecided else []},
        "finished": finished,
    }


def test_all_placements():
    assert (
        sentence(certificate()) == "Proved: greedy, it collects all 3 cubes from every placement."
    )
    assert "the cube from every" in sentence(certificate(cubes=1))


@pytest.mark.parametrize("undecided", [0.5, 1e-12])
def test_what_is_undecided_is_never_proved(undecided):
    text = sentence(certificate(won=1 - undecided, undecided=undecided))
    assert "every placement" not in text
    assert f"{undecided:.9g} are undecided" in text


def test_shares():
    text = sentence(certificate(won=0.75))
    assert "from a share of 0.75 of all placements and does not from a share of 0.25." in text


def test_a_proof_that_was_stopped():
    text = sentence(certificate(won=0.25, undecided=0.75, finished=False))
    assert text.endswith("so far (the proof was stopped).")
