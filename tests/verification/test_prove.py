"""Proofs from Python: folders, limits, text and refusals."""

import pytest

import drone_rl
from benchmarks.gamed_certificates import certificate_of
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.text import render
from drone_rl.verification.checker.certificate import Certificate
from drone_rl.verification.prove import Proof

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
    assert "front boundary" in text and "63.75%" in text and "Proved: with" in text
    assert "<table" in proof._repr_html_()


def test_load_proof(proof):
    again = drone_rl.load_proof(proof.folder).certificate
    assert again.model_dump_json() == proof.certificate.model_dump_json()
    assert not (proof.folder / "state.pt").exists()


def test_a_stopped_proof_resumes(proof, tmp_path):
    stopped = prove(folder=tmp_path, limit_s=0.0)
    assert not stopped.certificate.finished
    assert stopped.undecided == pytest.approx(1.0)
    assert "stopped by limit_s" in str(stopped)
    assert (tmp_path / "state.pt").exists()
    done = prove(folder=tmp_path)
    same = {"outcomes", "undecided", "finished"}
    one, two = (p.certificate.model_dump(include=same) for p in (done, proof))
    assert one == two


def test_a_state_of_another_policy_is_refused(tmp_path):
    prove(folder=tmp_path, limit_s=0.0)
    with pytest.raises(InputError, match="belongs to another proof"):
        prove("good", folder=tmp_path)


def certificate(won=1.0, undecided=0.0, finished=True, cubes=3):
    policy = drone_rl.load_policy("good").in_task(num_cubes=cubes)
    parts = {"all_cubes": won, "front_boundary": max(0.0, 1 - won - undecided)}
    about = {"collected": [True] * cubes, "loops": False, "steps": {}, "boxes": []}
    outcomes = [{**about, "end": end, "share": share} for end, share in parts.items() if share]
    left = [[[0.0, 1.0]] * cubes] if undecided else []
    data = certificate_of(policy, outcomes, left, undecided, finished)
    data["found"]["stopped_by"] = "limit_s"
    return Certificate.read(data)


def test_fractions_are_at_most_one():
    assert certificate(won=1.0, undecided=1e-17).success < 1.0
    whole = certificate()
    shares = [whole.outcomes[0].replace(share=share) for share in (0.07, 0.8725, 0.0575)]
    assert sum(of.share for of in shares) > 1 == whole.replace(outcomes=tuple(shares)).success


@pytest.mark.parametrize(
    "content", ["[]", '{"format": "another"}', '{"format": "drone_rl certificate"}']
)
def test_load_proof_refuses_other_files(tmp_path, content):
    (tmp_path / "certificate.json").write_text(content)
    with pytest.raises(InputError, match=r"certificate\.json"):
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
        (
            {"won": 0.75, "cubes": 1},
            "the cube from 75.00% of all placements; from 25.00% it does not.",
        ),
        ({"won": 0.5, "undecided": 0.5}, "and 50.00% are undecided."),
    ],
)
def test_statement(proved, text):
    (statement,) = Proof(certificate(**proved)).notes()
    assert text in statement and statement.startswith("Proved: with its most probable actions it")
    assert ("every placement" in statement) == (not proved)


def test_line_of_a_round():
    search = {"frames": 20_000, "failures": 3, "flights": 4000, "losing": None}

    def line(**proof):
        return render("drone_rl.verification", "round.j2", **search | proof)

    assert line() == "at frame 20,000: 3 of 4,000 episodes failed"
    assert line(losing=0.25, undecided=1e-7, proof_s=61.6).endswith(
        "failed; proof in 62 s: fails from 25.00% of all placements, <0.01% undecided"
    )
