"""Recorded flights: which steps become demonstrations."""

import numpy as np
import pytest

from drone_rl.training import demonstrations
from tests.flight.fly_page.test_flight import run, state_of


@pytest.fixture
def written(monkeypatch):
    """Folders and demonstrations that would have been written."""
    found = []
    monkeypatch.setattr(demonstrations, "add_demonstration", lambda *one: found.append(one))
    return found


def press(flight, *controls):
    for control in controls:
        flight.handle({"type": "hold", "controls": [control]})
        run(flight, 0.05)
        flight.handle({"type": "hold", "controls": []})


def test_steps_of_a_person_become_a_demonstration(make_flight, written, tmp_path):
    flight = make_flight()
    press(flight, "forward")  # before recording
    flight.handle({"type": "record", "on": True})
    frame = flight.world.see().frame[0]
    press(flight, "forward", "left", "right")
    assert state_of(flight)["recording"] == {"on": True, "steps": 3, "saved": 0, "problem": None}
    flight.handle({"type": "record", "on": False})
    assert state_of(flight)["recording"] == {"on": False, "steps": 0, "saved": 1, "problem": None}
    ((folder, one),) = written
    assert folder == tmp_path / "demonstrations" and one.pilot == "person"
    assert one.actions.tolist() == [0, 1, 2] and one.actions.dtype == np.int64
    assert one.images.shape == (3, 25, 64, 3) and one.images.dtype == np.uint8
    assert np.array_equal(one.images[0], frame.numpy())
    assert one.rewards.tolist() == [0.0, 0.0, 0.0] and one.rewards.dtype == np.float32
    assert one.done.tolist() == [False, False, False]
    assert one.conditions == demonstrations.FlightConditions(**flight.world.conditions)


def test_recording_switches_to_the_policys_actions(make_flight, written):
    flight = make_flight(mode="simple_flight")
    flight.handle({"type": "record", "on": True})
    state = state_of(flight)
    assert state["mode"] == "actions" and "now your controls" in state["texts"]["note"]
    press(flight, "forward")
    flight.handle({"type": "mode", "mode": "computer_vision"})  # ends this demonstration
    press(flight, "forward")
    flight.handle({"type": "record", "on": False})
    assert [len(one.actions) for _, one in written] == [1]


@pytest.mark.parametrize(
    "message",
    [
        {"type": "pilot", "pilot": "policy"},
        {"type": "reset"},
        {"type": "set", "name": "wind", "value": 2.0},
    ],
)
def test_a_demonstration_has_one_flyer_one_episode_and_one_wind(make_flight, written, message):
    flight = make_flight()
    flight.handle({"type": "record", "on": True})
    press(flight, "forward", "left")
    flight.handle(message)
    assert [(one.pilot, len(one.actions)) for _, one in written] == [("person", 2)]
    assert flight.recorder.is_on


def test_a_folder_that_cannot_be_written_is_reported_and_ends_recording(
    make_flight, written, monkeypatch
):
    def refuse(folder, one):
        raise OSError(28, "No space left on device")

    flight = make_flight()
    monkeypatch.setattr(demonstrations, "add_demonstration", refuse)
    flight.handle({"type": "record", "on": True})
    press(flight, "forward")
    flight.handle({"type": "reset"})
    recording = state_of(flight)["recording"]
    assert not recording["on"] and recording["saved"] == 0
    assert "can't be written (No space left on device)" in recording["problem"]
    flight.handle({"type": "record", "on": True})
    assert state_of(flight)["recording"]["problem"] is None
    press(flight, *["left"] * 60)  # beyond the side boundary: the episode ends
    state = state_of(flight)
    assert state["end"] == "outside the field, left or right" and not state["recording"]["on"]
    assert "can't be written" in state["recording"]["problem"]


def test_files_are_demonstrations_that_a_training_reads(make_flight, tmp_path):
    flight = make_flight()
    flight.handle({"type": "record", "on": True})
    press(flight, "forward", "right")
    flight.handle({"type": "record", "on": False})
    conditions = demonstrations.FlightConditions(**flight.world.conditions)
    (read,) = demonstrations.read_demonstrations(tmp_path / "demonstrations", conditions)
    assert read.actions.tolist() == [0, 2] and read.pilot == "person"
