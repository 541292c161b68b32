"""A policy in several bodies from Python, and what each body changes."""

import json

import pytest

import drone_rl
from drone_rl.config import DynamicsSettings
from drone_rl.config.commands import BODIES
from drone_rl.trust.bodies import changes_of
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent

TWO = ["computer vision", "wind 8 m/s"]
STILL = {"wind": [0.0, 0.0, 0.0], "gusts": 0.0}
FLYING = {"mode": "simple_flight", "camera_mount": "gimbal"}


@pytest.fixture(scope="module")
def done():
    near = drone_rl.load_policy("good").in_task(num_cubes=1)
    return drone_rl.bodies([near], episodes=4, bodies=TWO, progress=silent)


@pytest.mark.parametrize(
    ("body", "changes"),
    [
        ("computer vision", {"mode": "computer_vision", **STILL}),
        ("simple flight", {**FLYING, **STILL}),
        ("wind 2 m/s", {**FLYING, "wind": [0.0, 2.0, 0.0], "gusts": 0.5}),
        ("wind 8 m/s", {**FLYING, "wind": [0.0, 8.0, 0.0], "gusts": 2.0}),
        ("motors twice as slow", {**FLYING, **STILL, "rotor_time_constant": 0.02}),
        ("camera on the body", {**FLYING, **STILL, "camera_mount": "body"}),
    ],
)
def test_what_a_body_changes(body, changes):
    assert changes_of(body, DynamicsSettings(rotor_time_constant=0.01)) == changes


def test_every_body_can_be_flown():
    own = DynamicsSettings()
    for body in BODIES:
        own.replace(**changes_of(body, own))


def test_a_verdict_for_each_body(done):
    flown = done.numbers["policies"]["good"]
    assert done.numbers["bodies"] == [*flown] == TWO
    assert all(verdict["greedy"]["episodes"] == 4 for verdict in flown.values())
    assert flown["computer vision"]["greedy"]["success"]["share"] == 1.0


def test_it_shows_and_saves_itself(done, tmp_path):
    assert str(done).splitlines()[0].split() == ["computer", "vision", "wind", "8", "m/s"]
    assert "<td>good</td>" in done._repr_html_() and "<img" in done._repr_html_()
    done.save(tmp_path)
    kept = json.loads((tmp_path / "bodies.json").read_text())
    assert kept["policies"].keys() == {"good"} and "versions" in kept
    assert (tmp_path / "bodies.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "bodies.svg").read_text()


def test_it_tells_what_is_being_flown():
    said = []

    def note(text, done=0, total=0):
        said.append((text, done, total))

    near = drone_rl.load_policy("good").in_task(num_cubes=1)
    drone_rl.bodies(near, episodes=1, bodies=["computer vision"], progress=note)
    assert said == [("good: computer vision", 0, 1), ("flown", 1, 1)]


@pytest.mark.parametrize(
    ("policies", "told", "message"),
    [
        ("nobody", {}, "nobody"),
        ([], {}, r"policies=\[\] is empty"),
        (["good", "good"], {}, "two policies are called good"),
        ("good", {"bodies": ["submarine"]}, "submarine.* is unknown"),
    ],
)
def test_mistakes(policies, told, message):
    with pytest.raises(InputError, match=message):
        drone_rl.bodies(policies, progress=silent, **told)


def test_settings_of_another_class_are_refused():
    with pytest.raises(InputError, match=r"^settings=\(dict\) is no BodiesSettings"):
        drone_rl.bodies("good", {"episodes": 2}, progress=silent)
