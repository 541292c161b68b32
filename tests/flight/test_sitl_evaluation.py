"""Policies fly the stub firmware, in the worlds of evaluations."""

import shlex
import sys
from pathlib import Path

import pytest
import torch

import drone_rl
from drone_rl.envs import worlds_of
from drone_rl.flight import sitl_evaluation as looped
from drone_rl.flight.in_the_loop.drone import FlightControllerError, NotReadyError
from drone_rl.flight.sitl_evaluation import evaluate_in_the_loop
from drone_rl.trust.bodies import chart
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from tests.flight.arming import arm_at_once

STUB = Path(__file__).parent / "stub_firmware.py"


@pytest.fixture(scope="module")
def program(own_network, tmp_path_factory):
    """The stub as a program of its own."""
    path = tmp_path_factory.mktemp("program") / "stub"
    path.write_text(f"#!/bin/sh\nexec {shlex.join([sys.executable, '-I', str(STUB), ''])}\n")
    path.chmod(0o755)
    return path


def near():
    """One cube, near: a flight of two or three seconds."""
    changes = {"num_cubes": 1, "first_distance": 5.0, "lateral_bound": 1.0, "front_margin": 3.0}
    return drone_rl.load_policy("good").in_task(**changes)


@pytest.fixture(scope="module")
def flown(program):
    """An episode in the loop, and what `_fly` has returned of it."""
    returned, fly = [], looped._fly
    with pytest.MonkeyPatch.context() as patch:
        arm_at_once(patch)
        patch.setattr(looped, "_fly", lambda *given: returned.append(fly(*given)) or returned[-1])
        done = evaluate_in_the_loop(near(), 1, seed=3, firmware=program, progress=silent)
    return done, returned[0]


def test_it_flies_the_first_worlds_of_evaluations(program, flown, monkeypatch):
    """The second episode repeats the first one here; `test_worlds_...` shows that worlds differ."""
    _, (episodes, flight) = flown

    def fly(pilot, world, *given):
        return episodes, flight.replace(world=world)

    monkeypatch.setattr(looped, "_fly", fly)
    done = evaluate_in_the_loop(near(), 2, seed=3, firmware=program, progress=silent)
    assert [(f.world, f.success, f.end) for f in done.flights] == [
        (0, True, "all_cubes"),
        (1, True, "all_cubes"),
    ]
    success = done.success
    assert (success.successes, success.trials) == (2, 2)
    assert success.lower95 == pytest.approx(0.025**0.5)  # both of two, exactly
    assert str(done).splitlines()[-3:] == [
        "2 of 2 succeeded (95% CI 15.8% to 100%)",
        "Fixed seed 3: a policy could have been fitted to these environments.",
        "environments: seed 3 (fixed)",
    ]
    assert (done.seed, done.seed_is_fixed) == (3, True)


def test_an_episode_in_the_loop(flown):
    (first,) = flown[0].flights
    assert (first.world, first.success, first.end) == (0, True, "all_cubes")
    assert len(first.path) == first.steps + 1
    assert first.simulated_s == pytest.approx(first.steps * 0.099)
    assert first.path[0] == pytest.approx((0.0, 0.0, 2.5), abs=0.2)
    assert first.path[-1][0] > 2.0


def test_worlds_are_told_apart_by_their_number():
    """World 1 alone is world 1 of many."""
    policy = near()
    places = []
    for count, first in ((2, 0), (1, 1)):
        with policy.flying(count, seed=3, first_world=first) as (env, _):
            env.reset()
            places.append(worlds_of(env).task.places(worlds_of(env).state)[-1])
    assert torch.equal(*places)


def test_a_flight_that_has_not_begun_begins_anew(program, monkeypatch):
    tried = []

    def fly(pilot, world, *given):
        tried.append(world)
        raise NotReadyError("the firmware refuses to arm")

    monkeypatch.setattr(looped, "_fly", fly)
    with pytest.raises(FlightControllerError, match="refuses to arm"):
        evaluate_in_the_loop(near(), 2, firmware=program, progress=silent)
    assert tried == [0, 0, 0]


def test_what_is_refused(tmp_path):
    with pytest.raises(InputError, match="flights=0"):
        evaluate_in_the_loop("good", 0)
    with pytest.raises(InputError, match=r"doesn't exist; install it with"):
        evaluate_in_the_loop("good", 1, firmware=tmp_path / "none")


def test_a_column_of_bodies(program, monkeypatch):
    """The stub flies two of the worlds of the verdict; what can't be flown is left out."""
    asked = {"bodies": ["simple flight"], "episodes": 2, "num_envs": 2, "loop_flights": 1}
    monkeypatch.setattr(looped, "find_firmware", lambda path: program)
    done = drone_rl.bodies([near()], **asked, progress=silent)
    flights = done.in_the_loop["good"]
    assert flights.success.trials == len(flights.flights) == 1
    assert str(done).splitlines()[1].endswith("to 100%)")
    cells = chart(done).axes[0].tables[0].get_celld().values()
    words = [cell.get_text().get_text().replace("\n", " ") for cell in cells]
    assert "software in the loop" in words
    assert any(word.startswith("no verdict: 1 of 1") for word in words)

    def none(path):
        raise InputError("firmware=x isn't there")

    monkeypatch.setattr(looped, "find_firmware", none)
    done = drone_rl.bodies([near()], **asked, progress=silent)
    lines = str(done).splitlines()
    assert lines[-2] == "good, software in the loop: firmware=x isn't there"
    assert lines[-1] == f"environments: seed {done.seed} (fresh)"
    assert "isn't there" in done._repr_html_() or "isn&#" in done._repr_html_()
    without = drone_rl.bodies([near()], **(asked | {"loop_flights": 0}), progress=silent)
    assert without.in_the_loop == {}
