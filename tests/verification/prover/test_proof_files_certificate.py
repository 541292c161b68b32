"""Certificates: what is in one, and that the second checker, which shares nothing, accepts it."""

import json
from contextlib import closing

import numpy as np
import pytest

import drone_rl
from drone_rl.policies.zoo import fingerprint
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.utils.provenance import provenance
from drone_rl.verification.prover.boxes import volumes
from drone_rl.verification.prover.lattice import Ending
from drone_rl.verification.prover.policy_spec import make_policy_spec
from drone_rl.verification.prover.proof_files import certify
from drone_rl.verification.prover.prover import ProofFindings, Prover


@pytest.fixture(scope="module")
def proof(tmp_path_factory):
    folder = tmp_path_factory.mktemp("proof")
    task = {"num_cubes": 1}
    return drone_rl.prove("right_and_forward", folder=folder, task=task, compared=100)


def test_shares_add_up(proof):
    found = proof.certificate
    total = sum(o["share"] for o in found["outcomes"]) + found["undecided"]["share"]
    assert total == pytest.approx(1.0, abs=1e-12)
    assert found["finished"] is True
    for outcome in found["outcomes"]:
        assert sum(outcome["steps"].values()) <= outcome["share"] + 1e-12


def test_no_fraction_exceeds_one_by_rounding():
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1)
    ends = np.sort([-6.0, 6.0, *np.random.RandomState(57).uniform(-6, 6, 50)])
    boxes = np.stack([ends[:-1], ends[1:]], -1)[:, None]
    volume = float(volumes(boxes).sum())
    assert volume > 12
    ending = Ending(EndReason.FRONT_BOUNDARY, 0)
    found = ProofFindings({ending: boxes}, boxes[:0], {ending: {26: volume}})
    with closing(make_policy_spec(policy.description, policy.make_network(), 1e-4)) as spec:
        prover = Prover(spec)
        prover.findings = lambda: found
        (outcome,) = certify("name", policy.description, "", prover, 1.0)["outcomes"]
    assert outcome["share"] == outcome["steps"]["26"] == 1.0


def test_it_is_data(proof):
    assert json.loads((proof.folder / "certificate.json").read_text()) == proof.certificate


def test_the_second_checker_accepts_it(proof):
    assert drone_rl.check(proof.folder / "certificate.json", flights=300).accepted


def test_what_is_stated_when_it_is_stopped_within_a_part_is_accepted(tmp_path):
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1, lateral_bound=2.0)
    network = policy.make_network()
    path, found = tmp_path / "certificate.json", {}
    with closing(make_policy_spec(policy.description, network, 1e-4)) as spec:
        prover = Prover(spec, 200)
        while prover.parts.size:
            prover.advance()
        while not prover.ended:
            prover.advance()
        assert prover.part.size and prover.waiting and prover.done.endings
        weights = fingerprint(policy.state["policy"])
        found = certify(policy.name, policy.description, weights, prover, 1.0, "limit_s")
    path.write_text(json.dumps(found | provenance()))
    assert not found["finished"] and found["found"]["stopped_by"] == "limit_s"
    shares = sum(o["share"] for o in found["outcomes"])
    assert 0.0 < shares < 1.0 and shares + found["undecided"]["share"] == pytest.approx(1.0)
    assert drone_rl.check(path, flights=150).accepted
    found["outcomes"][0]["boxes"] += found["undecided"]["boxes"][:1]
    path.write_text(json.dumps(found | provenance()))
    assert not drone_rl.check(path, flights=150).accepted


def test_the_second_checker_refuses_what_was_changed(proof, tmp_path):
    """The border moved by half a metre: flights there end otherwise."""
    changed = json.loads(json.dumps(proof.certificate))
    lost, won = sorted(changed["outcomes"], key=lambda o: o["end"] == "all_cubes")
    low, high = min(won["boxes"])[0], max(lost["boxes"])[0]
    assert low[0] == -6.0 and high[1] == 6.0
    moved = 0.5
    won["boxes"], lost["boxes"] = [[[-6.0, 1.65 + moved]]], [[[1.65 + moved, 6.0]]]
    won["share"], lost["share"] = (7.65 + moved) / 12, (4.35 - moved) / 12
    won["steps"], lost["steps"], changed["undecided"] = {}, {}, {"share": 0.0, "boxes": []}
    path = tmp_path / "changed.json"
    path.write_text(json.dumps(changed))
    found = drone_rl.check(path, flights=300)
    assert not found.accepted
