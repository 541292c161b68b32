"""Proofs from Python: folders, limits, text and refusals."""

import pytest

import drone_rl
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.verification.prove import Proof
from drone_rl.verification.text import describe_proof, describe_round

ONE = {"num_cubes": 1}


def prove(name="right_and_forward", **kwargs):
    return drone_rl.prove(name, task=ONE, compared=100, progress=silent, **kwargs)


@pytest.fixture(scope="module")
def proof(tmp_path_factory):
    return prove(folder=tmp_path_factory.mktemp("proof"))


def test_a_proved_policy(tmp_path):
    proof = prove("good")
    assert proof.is_proved and proof.success == 1.0
    assert proof.losing().shape == (0, 1, 2)
    assert proof.folder is None


def test_text(proof):
    text = str(proof)
    assert "front boundary" in text and "0.6375" in text and "Proved: with" in text
    assert "<table" in proof._repr_html_()


def test_load_proof(proof):
    assert drone_rl.load_proof(proof.folder).certificate == proof.certificate
    assert not (proof.folder / "state.pt").exists()


def test_fractions_are_at_most_one():
    shares = (0.07, 0.8725, 0.0575)
    assert sum(shares) > 1
    for end, found in (("all_cubes", "success"), ("front_boundary", "lost")):
        outcomes = [{"end": end, "share": share} for share in shares]
        assert getattr(Proof({"outcomes": outcomes}), found) == 1.0


def test_a_stopped_proof_resumes(proof, tmp_path):
    stopped = prove(folder=tmp_path, limit_s=0.0)
    assert not stopped.certificate["finished"]
    assert stopped.undecided == pytest.approx(1.0)
    assert "stopped by limit_s" in str(stopped)
    assert (tmp_path / "state.pt").exists()
    done = prove(folder=tmp_path)
    same = ("outcomes", "undecided", "finished")
    assert [done.certificate[k] for k in same] == [proof.certificate[k] for k in same]


def test_a_state_of_another_policy_is_refused(tmp_path):
    prove(folder=tmp_path, limit_s=0.0)
    with pytest.raises(InputError, match="belongs to another proof"):
        prove("good", folder=tmp_path)


def certificate(won=1.0, undecided=0.0, finished=True, cubes=3):
    outcomes = [{"end": "all_cubes", "share": won}] if won else []
    if won + undecided < 1:
        outcomes.append({"end": "front_boundary", "share": 1 - won - undecided})
    return {
        "policy": {"description": {"task": {"num_cubes": cubes}}},
        "outcomes": outcomes,
        "undecided": {"share": undecided, "boxes": [[[0, 1]]] if undecided else []},
        "finished": finished,
        "found": {"stopped_by": "limit_s"},
    }


@pytest.mark.parametrize(
    "content", ["[]", '{"format": "another"}', '{"format": "drone_rl certificate"}']
)
def test_load_proof_refuses_other_files(tmp_path, content):
    (tmp_path / "certificate.json").write_text(content)
    with pytest.raises(InputError, match="can't be used"):
        drone_rl.load_proof(tmp_path)


def test_most_boxes_stops_a_proof_in_parts():
    task = {**ONE, "lateral_bound": 2.0}
    texts = []
    stopped = drone_rl.prove(
        "good",
        task=task,
        compared=1,
        most_combinations=400,
        most_boxes=1,
        progress=lambda text, *_: texts.append(text),
    )
    assert "1 part to come" in texts[0] and texts[-1] == "stopped by most_boxes"
    assert texts[-1] in str(stopped) and stopped.undecided == pytest.approx(1.0)


def test_tasks_that_take_days_are_refused():
    with pytest.raises(InputError, match="which takes days"):
        drone_rl.prove("good", task={"num_cubes": 30}, progress=silent)


@pytest.mark.parametrize(
    ("proved", "text"),
    [
        ({}, "it collects all 3 cubes from every placement."),
        ({"won": 0.75}, "from 75% of all placements; from 25% it does not."),
        ({"won": 1 - 1e-12, "undecided": 1e-12}, "from more than 99.9999999% of all placements"),
        ({"won": 0.0}, "; from 100% it does not."),
        ({"won": 1e-12}, "from more than 99.9999999% it does not."),
        ({"won": 0.5, "undecided": 0.5}, "50% are undecided"),
        ({"won": 0.0, "undecided": 1.0, "finished": False}, "100% are undecided so far"),
    ],
)
def test_describe_proof(proved, text):
    assert text in describe_proof(certificate(**proved))
    assert ("every placement" in text) == (not proved)


def test_describe_round():
    search = {"frames": 20_000, "failures": 3, "flights": 4000, "losing": None}
    assert describe_round(search) == "at frame 20,000: 3 of 4,000 episodes failed"
    proof = {"losing": 0.25, "undecided": 1e-7, "proof_s": 61.6}
    assert "fails from 25% of all placements, 1e-05% undecided" in describe_round(search | proof)
