"""The flight: messages of browsers, hand-over, time, frames."""

import io

import numpy as np
import pytest
from PIL import Image

from drone_rl.sim.dynamics.state import LOST
from drone_rl.utils.errors import InputError
from tests.flight.fly_page.conftest import decode


def run(flight, seconds, period=0.025):
    for _ in range(round(seconds / period)):
        flight.advance(period)


def state_of(flight):
    return decode(flight.frame())[0]


def test_a_frame_has_the_state_and_two_images(make_flight):
    state, images = decode(make_flight().frame())
    assert state["frame"] == 1 and state["position"] == [0.0, 0.0, 2.5]
    assert state["attitude"] == [0.0, 0.0, 0.0]
    assert (state["pilot"], state["mode"], state["camera"]) == ("person", "actions", "front_center")
    assert state["goals"] == [0, 3] and state["end"] is None
    assert sum(state["probabilities"]) == pytest.approx(1.0, abs=0.01)
    view = Image.open(io.BytesIO(images["view"]))
    assert (view.format, view.size) == ("JPEG", (256, 144))
    observation = Image.open(io.BytesIO(images["observation"]))
    assert (observation.format, observation.size) == ("PNG", (64, 25))


def test_the_policy_collects_the_cubes_and_the_next_episode_begins(make_flight):
    flight = make_flight()
    flight.handle({"type": "pilot", "pilot": "policy"})
    run(flight, 12.0)
    ended = None
    for _ in range(400):
        run(flight, 0.1)
        state = state_of(flight)
        ended = state if state["end"] else ended
        if state["episode"] == 2:
            break
    assert ended["end"] == "with every cube collected" and ended["goals"] == [3, 3]
    texts = ended["texts"]
    assert texts["end"] == "Episode over, with every cube collected. The next one begins."
    assert (texts["score"], texts["flyer"]) == ("3 of 3 cubes collected", "The policy good flies")
    assert state["episode"] == 2 and state["pilot"] == "policy"


def test_a_person_takes_over_and_hands_back(make_flight):
    flight = make_flight(mode="computer_vision")
    flight.handle({"type": "pilot", "pilot": "policy"})
    run(flight, 1.0)
    x, y, _ = state_of(flight)["position"]
    flight.handle({"type": "pilot", "pilot": "person"})
    run(flight, 1.0)
    assert state_of(flight)["position"] == [x, y, 2.5]  # nobody steers
    for control in ("yaw_right", "up", "up"):
        flight.handle({"type": "hold", "controls": [control]})
        run(flight, 0.05)
        flight.handle({"type": "hold", "controls": []})
    turned = state_of(flight)
    assert turned["position"][2] == pytest.approx(3.0)
    assert turned["attitude"] == pytest.approx([0.0, 0.0, 5.0], abs=0.01)
    flight.handle({"type": "pilot", "pilot": "policy"})
    run(flight, 0.3)
    state = state_of(flight)
    assert state["attitude"] == [0.0, 0.0, 0.0] and state["position"][2] == 2.5
    assert state["texts"]["note"] == "The policy good flies, from the task's altitude and heading."


def test_the_policy_gets_a_new_episode_if_the_last_one_is_over(make_flight):
    flight = make_flight()
    for _ in range(60):
        flight.handle({"type": "hold", "controls": ["left"]})
        run(flight, 0.05)
        flight.handle({"type": "hold", "controls": []})
    state = state_of(flight)
    assert state["end"] == "outside the field, left or right" and state["episode"] == 1
    flight.handle({"type": "pilot", "pilot": "policy"})
    state = state_of(flight)
    assert state["end"] is None and state["episode"] == 2 and state["pilot"] == "policy"


def test_controls_are_released_when_something_else_flies(make_flight):
    flight = make_flight()
    flight.handle({"type": "hold", "controls": ["forward"]})
    run(flight, 0.1)
    flight.handle({"type": "mode", "mode": "computer_vision"})
    run(flight, 2.0)
    assert state_of(flight)["position"] == [1.0, 0.0, 2.5]
    flight.handle({"type": "hold", "controls": ["forward"]})
    flight.release()
    run(flight, 2.0)
    assert state_of(flight)["position"] == [1.0, 0.0, 2.5]


def test_sliders_set_speed_wind_and_light(make_flight):
    flight = make_flight("flight")
    for name, value in (("speed", 2.0), ("wind", 6.0), ("wind_from", 90.0), ("light", 0.5)):
        flight.handle({"type": "set", "name": name, "value": value})
    settings = state_of(flight)["settings"]
    assert settings == {"speed": 2.0, "wind": 6.0, "wind_from": 90.0, "light": 0.5}
    assert flight.world.worlds.dynamics.settings.wind == pytest.approx((0.0, 6.0, 0.0), abs=1e-12)


def test_a_simulation_that_diverges_says_so_and_a_new_episode_goes_on(make_flight):
    flight = make_flight(mode="simple_flight")
    flight.world.body.numbers[:, LOST] = 1.0
    flight.handle({"type": "hold", "controls": ["forward"]})
    run(flight, 0.2)
    assert "has diverged; start a new episode" in state_of(flight)["texts"]["note"]
    flight.handle({"type": "reset"})
    flight.handle({"type": "hold", "controls": ["forward"]})
    run(flight, 1.0)
    assert state_of(flight)["position"][0] > 0.2


def test_taking_off_needs_simple_flight(make_flight):
    flight = make_flight()
    with pytest.raises(InputError, match="take_off needs simple flight; choose it"):
        flight.handle({"type": "take_off"})
    flight.handle({"type": "mode", "mode": "simple_flight"})
    flight.handle({"type": "land"})
    flight.handle({"type": "hold", "controls": ["forward"]})
    run(flight, 1.0)
    with pytest.raises(InputError, match="can't take off while moving"):
        flight.handle({"type": "take_off"})


@pytest.mark.parametrize(
    ("message", "problem"),
    [
        (None, "message=None must be a mapping"),
        ({"type": "hold"}, "hold.controls is missing"),
        ({"type": "set", "name": "light", "value": 9.0}, "light=9.0"),
        ({"type": "reset", "now": True}, "^reset.now is unknown; leave it out$"),
    ],
)
def test_wrong_messages_are_refused_with_the_reason(make_flight, message, problem):
    flight = make_flight()
    with pytest.raises(InputError, match=problem):
        flight.handle(message)
    assert state_of(flight)["episode"] == 1


def test_heat_is_laid_over_the_observation_of_a_trusted_method(make_flight):
    flight = make_flight()
    plain = decode(flight.frame())[1]["observation"]
    flight.saliency.trust("saliency")
    assert decode(flight.frame())[1]["observation"] == plain  # it is switched off
    flight._shows_saliency = True
    state, images = decode(flight.frame())
    assert state["saliency"] and "method saliency, which passed" in state["texts"]["method"]
    hot = np.asarray(Image.open(io.BytesIO(images["observation"]))).astype(int)
    assert (hot[..., 0] - hot[..., 2]).max() > 60  # warm colors, where all was gray
