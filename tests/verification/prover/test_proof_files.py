"""Saved states resume a proof exactly; the independent checker accepts its certificate."""

import json
from contextlib import closing

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.policies.zoo import fingerprint
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.boxes import volumes
from drone_rl.verification.prover.lattice import Ending
from drone_rl.verification.prover.policy_spec import make_policy_spec
from drone_rl.verification.prover.proof_files import certify, load, save
from drone_rl.verification.prover.prover import ProofFindings, Prover


@pytest.fixture(scope="module")
def spec():
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1)
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    yield spec
    spec.close()


@pytest.fixture(scope="module")
def narrow():
    """A small task, so that a proof in parts of 100 combinations has two of them."""
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1, lateral_bound=1.0)
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    yield spec
    spec.close()


@pytest.fixture(scope="module")
def uninterrupted(spec):
    return finish(Prover(spec))


@pytest.fixture(scope="module")
def uninterrupted_parts(narrow):
    return finish(Prover(narrow, 100))


def finish(prover):
    while not prover.is_finished:
        prover.advance()
    found = prover.findings()
    endings = {e: sorted(b.tolist()) for e, b in found.endings.items()}
    return endings, found.steps, sorted(found.undecided.tolist()), prover.num_states


@pytest.mark.parametrize("states", [3, 40])
def test_resume(spec, uninterrupted, tmp_path, states):
    path = tmp_path / "state.pt"
    stopped = Prover(spec)
    for _ in range(states):
        stopped.advance()
    save(stopped, path, "this")
    later = Prover(spec)
    load(later, path, "this")
    assert later.decided == stopped.decided
    assert finish(later) == uninterrupted


@pytest.mark.parametrize("states", [5, None])
def test_resume_within_a_part_or_between_parts(narrow, uninterrupted_parts, tmp_path, states):
    path, stopped, later = tmp_path / "state.pt", *(Prover(narrow, 100) for _ in range(2))
    assert len(stopped.parts) == 2
    stopped.advance()
    while stopped.waiting and stopped.num_states != states:
        stopped.advance()
    assert len(stopped.parts) == 1 and bool(stopped.waiting) == bool(states)
    save(stopped, path, "this")
    load(later, path, "this")
    assert len(later.parts) == 1 and later.boxes_under_way == stopped.boxes_under_way
    assert finish(later) == uninterrupted_parts


def test_the_state_of_another_proof_is_refused(spec, tmp_path):
    path = tmp_path / "state.pt"
    save(Prover(spec), path, "this")
    with pytest.raises(InputError, match="belongs to another proof"):
        load(Prover(spec), path, "that")


@pytest.fixture(scope="module")
def proof(tmp_path_factory):
    folder = tmp_path_factory.mktemp("proof")
    task = {"num_cubes": 1}
    return drone_rl.prove("right_and_forward", folder=folder, task=task, compared=100)


def test_fractions_are_at_most_one():
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1)
    ends = np.sort([-6.0, 6.0, *np.random.RandomState(57).uniform(-6, 6, 50)])
    boxes = np.stack([ends[:-1], ends[1:]], -1)[:, None]
    volume = float(volumes(boxes).sum())
    assert volume > 12
    ending = Ending(CubesEnd.FRONT_BOUNDARY, 0)
    found = ProofFindings({ending: boxes}, boxes[:0], {ending: {26: volume}})
    with closing(make_policy_spec(policy.description, policy.make_network(), 1e-4)) as spec:
        prover = Prover(spec)
        prover.findings = lambda: found
        (outcome,) = certify("name", policy.description, "", prover, 1.0).outcomes
    assert outcome.share == outcome.steps[26] == 1.0


def test_the_checker_accepts_a_certificate(proof):
    assert drone_rl.check(proof.folder / "certificate.json", flights=300).accepted


def test_the_checker_accepts_an_unfinished_certificate(tmp_path):
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1, lateral_bound=2.0)
    network = policy.make_network()
    path = tmp_path / "certificate.json"
    with closing(make_policy_spec(policy.description, network, 1e-4)) as spec:
        prover = Prover(spec, 200)
        while prover.parts.size:
            prover.advance()
        while not prover.ended:
            prover.advance()
        assert prover.part.size and prover.waiting and prover.done.endings
        weights = fingerprint(policy.state.weights)
        found = certify(policy.name, policy.description, weights, prover, 1.0, "limit_s")
    found.write_json(path)
    assert not found.finished and found.found.stopped_by == "limit_s"
    assert 0.0 < found.success + found.lost < 1.0
    assert drone_rl.check(path, flights=150).accepted
    data = json.loads(path.read_text())
    data["outcomes"][0]["boxes"] += data["undecided"]["boxes"][:1]
    path.write_text(json.dumps(data))
    assert not drone_rl.check(path, flights=150).accepted


@pytest.mark.parametrize(
    "state",
    [
        b"no archive",
        {"proof_id": print},
    ],
)
def test_a_damaged_state_is_refused(spec, tmp_path, state):
    path = tmp_path / "state.pt"
    if isinstance(state, bytes):
        path.write_bytes(state)
    else:
        torch.save(state, path)
    with pytest.raises(InputError, match="is damaged, or of an older version"):
        load(Prover(spec), path, "this")
