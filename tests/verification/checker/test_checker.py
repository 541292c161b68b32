"""Episodes simulated by the checker: equal to an evaluation, refute false statements."""

import itertools

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.collectors.complete_episodes import rollout
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.verification.check import check
from drone_rl.verification.checker.certificate import Certificate, Outcome
from drone_rl.verification.checker.checker import (
    EpisodeEnds,
    Simulator,
    check_certificate,
    ends_as_stated,
)
from tests.verification.checker.tampering import BYTES, CHANGES, tampered


def findings(data, **settings):
    weights = drone_rl.load_policy(data["policy"]["name"]).state.weights
    return check_certificate(Certificate.read(data), weights, **{"flights": 120, **settings})


def test_true_certificates_are_accepted(one_sided, two_halves):
    for data in (one_sided, two_halves):
        found = findings(data)
        assert found.accepted, found.lines()
        assert found.lines() == []
        assert 110 <= sum(found.flights.values()) <= 120
    assert "border" not in found.flights


def test_a_wrong_outcome_is_contradicted_by_episodes(one_sided):
    won, lost = one_sided["outcomes"]
    won["boxes"], lost["boxes"] = lost["boxes"], won["boxes"]
    won["share"], lost["share"] = lost["share"], won["share"]
    won["steps"], lost["steps"] = lost["steps"], won["steps"]
    found = findings(one_sided)
    assert not found.accepted and found.contradicted == sum(found.flights.values())
    assert 1.65 < found.contradictions[0].placement[0] < 6
    assert len(found.contradictions) == 20 and len(found.lines()) == 21
    assert f" {found.contradicted - 20} flights more" in found.lines()[-1]


def test_a_shifted_border_is_found(one_sided):
    """Off by a twentieth of a millimetre: no flight anywhere is likely to tell."""
    won, lost = one_sided["outcomes"]
    for part, end in (
        (won, 1),
        (one_sided["undecided"], 0),
        (one_sided["undecided"], 1),
        (lost, 0),
    ):
        part["boxes"][0][0][end] += 5e-5
    cut = won["boxes"][0][0][1], lost["boxes"][0][0][0]
    won["share"], lost["share"] = (cut[0] + 6) / 12, (6 - cut[1]) / 12
    one_sided["undecided"]["share"] = (cut[1] - cut[0]) / 12
    for part in (won, lost):
        total = sum(part["steps"].values())
        part["steps"] = {n: 0.97 * part["share"] * s / total for n, s in part["steps"].items()}
    found = findings(one_sided)
    assert {c.where for c in found.contradictions} == {"inside"}  # a corner
    assert found.contradictions[0].placement[0] == pytest.approx(1.65004, abs=1e-5)


def test_an_inconsistent_certificate_is_not_simulated(one_sided):
    one_sided["outcomes"][0]["share"] = 0.5
    found = findings(one_sided)
    assert (found.accepted, found.flights, found.contradicted) == (False, {}, 0)
    assert "has a share of 0.5" in found.lines()[0]


def test_a_certificate_without_statements_is_accepted(one_sided):
    one_sided |= {"outcomes": [], "undecided": {"share": 1.0, "boxes": [[[-6.0, 6.0]]]}}
    found = findings(one_sided)
    assert found.accepted and sum(found.flights.values()) == 0


LIMIT = CubesEnd.STEP_LIMIT


@pytest.mark.parametrize(
    ("end", "collected", "repeats", "loops", "steps", "right"),
    [
        (LIMIT, False, 200, True, {300: 0.5}, True),
        (LIMIT, False, 1, True, {300: 0.5}, True),
        (LIMIT, False, 0, True, {300: 0.5}, False),  # does not go to and fro
        (LIMIT, False, 200, False, {300: 0.5}, False),  # does
        (LIMIT, False, 2, False, {300: 0.5}, True),  # began with the end
        (LIMIT, True, 200, True, {300: 0.5}, False),
        (CubesEnd.FRONT_BOUNDARY, False, 200, True, {300: 0.5}, False),
        (CubesEnd.SIDE_BOUNDARY, False, 0, True, {300: 0.5}, False),
        (LIMIT, False, 200, True, {299: 0.5}, False),
        (LIMIT, False, 200, True, {299: 0.4}, True),  # of the others the steps are not certain
    ],
)
def test_ends_as_stated(end, collected, repeats, loops, steps, right):
    about = {"end": "step_limit", "collected": [False], "loops": loops, "boxes": []}
    stated = Outcome.read(about | {"share": 0.5, "steps": steps})
    flown = EpisodeEnds(*map(np.array, ([int(end)], [[collected]], [300], [repeats])))
    assert ends_as_stated(stated, flown, 0) is right


@pytest.fixture
def make():
    made = []

    def simulator(name="good", **task):
        policy = drone_rl.load_policy(name).in_task(**task)
        made.append(Simulator(policy.description, policy.state.weights))
        return made[-1]

    yield simulator
    for one in made:
        one.close()


def test_simulator_matches_evaluation(make):
    policy = drone_rl.load_policy("right_and_forward")
    with policy.flying(20) as (env, actor):
        episodes = rollout(actor, env, 20)
    lateral = episodes.goals.world.reshape(20, 3, 3)[..., 1].double().numpy()
    flown = make("right_and_forward").fly(lateral)
    assert flown.end.tolist() == episodes.end_reason.tolist()
    assert flown.steps.tolist() == episodes.length.tolist()
    assert flown.collected.tolist() == episodes.goals.reached.tolist()


def test_touch_distance(make):
    flown = make("right_and_forward", num_cubes=1).fly(np.array([[1.64], [1.66]]))
    assert flown.end.tolist() == [CubesEnd.ALL_CUBES, CubesEnd.FRONT_BOUNDARY]
    assert flown.collected.tolist() == [[True], [False]]


class Scripted(torch.nn.Module):
    """Take the same actions in all environments."""

    def __init__(self, actions):
        super().__init__()
        self.actions = iter(actions)

    def forward(self, pixels):
        logits = torch.zeros(len(pixels), 3)
        logits[:, next(self.actions)] = 1.0
        return logits


@pytest.mark.parametrize(
    ("actions", "end", "steps", "repeats"),
    [
        (itertools.cycle([1, 2]), CubesEnd.STEP_LIMIT, 40, 39),
        (itertools.chain([1, 2] * 3, itertools.repeat(0)), CubesEnd.ALL_CUBES, 20, 0),
    ],
    ids=["oscillates", "moves on"],
)
def test_repeats_are_counted_until_the_drone_moves_on(make, actions, end, steps, repeats):
    simulator = make(num_cubes=1, step_limit=40)
    simulator._network = Scripted(actions)
    flown = simulator.fly(np.zeros((2, 1)))
    assert flown.end.tolist() == [end] * 2
    assert flown.steps.tolist() == [steps] * 2
    assert flown.repeats.tolist() == [repeats] * 2


def test_episodes_are_simulated_in_batches(make):
    simulator = make(num_cubes=1)
    simulator.batch_size = 2
    assert simulator.fly(np.array([[-5.9], [0.0], [5.9], [0.1], [2.0]])).steps.tolist() == [
        *(19, 14, 19, 14, 15)
    ]


def is_accepted(path):
    try:
        return check(path, flights=400, seed=0, progress=silent).accepted
    except InputError:
        return False


@pytest.mark.parametrize("name", [*BYTES, *CHANGES])
def test_a_tampered_certificate_is_rejected(one_sided, write, name):
    assert not is_accepted(write(tampered(one_sided)[name]))


def test_the_certificate_itself_is_accepted(one_sided, write):
    assert is_accepted(write(one_sided))
