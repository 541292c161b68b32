import numpy as np
import pytest

from benchmarks import places
from benchmarks.places import bench_places, compare


@pytest.fixture
def subject():
    import drone_rl
    from drone_rl.verification.prover.policy_spec import make_policy_spec

    policy = drone_rl.load_policy("good").in_task(num_cubes=2)
    made = make_policy_spec(policy.description, policy.make_network(), 0.0)
    yield made
    made.close()


def test_time_cells_and_compared_images(monkeypatch):
    numbers = {"seconds": 2.0, "cells": 7}
    monkeypatch.setattr(places, "places", lambda *_, **__: type("P", (), {"numbers": numbers}))
    found = bench_places(quick=True)
    assert (found["places_s"], found["places_cells"], found["places_wrong"]) == (2.0, 7, 0)
    assert 380 <= found["places_compared"] <= found["places_drawn"] == 400


def test_a_wrong_closed_form_is_detected(subject, monkeypatch):
    random_state = np.random.RandomState(0)
    assert compare(subject.images, 35.0, 2, 20, random_state)[0] == 0
    monkeypatch.setattr("drone_rl.verification.prover.cube_images.camera_ahead", lambda: 0.9)
    wrong, compared = compare(subject.images, 35.0, 2, 20, random_state)
    assert 0 < wrong <= compared <= 20
