"""The exact map of a small policy, compared with the simulator's images."""

import json
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config.networks import Mlp
from drone_rl.explanations.report.places import rows
from drone_rl.explanations.scenes import Scenes, place_target
from drone_rl.policies.policy import Policy
from drone_rl.sim.vocabulary import SHOWN_MOVES
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.text import exact_percent
from drone_rl.verification.prover.cube_images import camera_ahead


@pytest.fixture(scope="module")
def small():
    """A policy of 12x5 pixels with random weights and opinions."""
    good = drone_rl.load_policy("good")
    image = good.description.inputs["pixels"].replace(size=(5, 12))
    description = good.description.replace(inputs={"pixels": image}, network=Mlp(hidden=(8,)))
    network = description.build_network(torch.Generator().manual_seed(3))
    weights = {name: 20 * value for name, value in network.state_dict().items()}
    return Policy(
        "small",
        good.path,
        description,
        good.state.replace(description=description, weights=weights),
    )


@pytest.fixture(scope="module")
def done(small):
    return drone_rl.places(small, progress=silent, compared=200)


def test_actions_equal_those_for_rendered_images(small, done):
    random_state = np.random.RandomState(0)
    places = random_state.uniform((2.5, -8.0), (20.0, 8.0), (2000, 2))
    env = small.make_env(8)
    scenes = Scenes(env)
    ahead, left = torch.from_numpy(places).T
    observations = scenes.observe(place_target(scenes, ahead + camera_ahead(), left))
    with torch.no_grad():
        taken = small.make_network()(observations).argmax(-1).numpy()
    env.close()
    assert len(set(taken)) == 3
    assert (done.places.at(places) != taken).sum() == 0
    shares = np.bincount(taken, minlength=3) / 2000
    assert done.actions == pytest.approx(shares, abs=0.05)


def test_areas_fill_the_window(done):
    assert done.area == pytest.approx(17.5 * 16, rel=1e-12)
    assert sum(done.actions) == pytest.approx(1)
    assert sum(side.share for side in done.sides.values()) == pytest.approx(1)
    assert done.sides["ahead"].share == pytest.approx(2 * 1.65 / 16)
    assert 190 <= done.compared <= 200


def test_at(done):
    assert done.at(10.0, 0.1) in ("forward", "left", "right")
    for place in ((1.0, 0.0), (10.0, 8.1), (21.0, 0.0)):
        with pytest.raises(InputError, match="outside of the map"):
            done.at(*place)


def test_save_and_text(done, tmp_path):
    done.save(tmp_path)
    kept = json.loads((tmp_path / "places.json").read_text())
    assert kept["cells"] == len(done.places.action) and kept["policy"] == "small"
    assert (tmp_path / "places.png").read_bytes().startswith(b"\x89PNG")
    root = ElementTree.parse(tmp_path / "places.svg").getroot()
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    assert "With one cube 2.5 to 20 m ahead" in str(done)
    shown = done._repr_html_()
    assert "<table>" in shown and "data:image/png" in shown


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"nearest": 1.0}, r"nearest=1.0 puts the camera into a cube"),
        ({"most_cells": 5}, r"more than 5 cells"),
        ({"task": {"vertical_bound": 1.0}}, r"task.vertical_bound=1.0"),
    ],
)
def test_unusable_settings_are_refused(small, change, message):
    with pytest.raises(InputError, match=message):
        drone_rl.places(small, progress=silent, **{"compared": 10} | change)


def test_rows(done):
    _, *sides, anywhere = rows(done, SHOWN_MOVES.names)
    left = done.sides["left"]
    values = [left.share, *left.actions, left.unseen, left.blind]
    assert sides[0] == ["on its left", *map(exact_percent, values)]
    assert anywhere[:2] == ["anywhere", "100%"]
