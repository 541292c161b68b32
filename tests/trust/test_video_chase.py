"""The drone from behind, tilted; the camera that films it, level."""

import math

import pytest
import torch

from drone_rl.config import DynamicsSettings
from drone_rl.sim.entities import CHASE
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.appearance import product, rotate, turned
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.worlds import Worlds
from drone_rl.trust.video import level, render_chase

SIZE = {"height": 60, "width": 90}


def worlds(mode="simple_flight", mount="gimbal"):
    return Worlds(1, dynamics=DynamicsSettings(mode=mode, camera_mount=mount))


def roll(drones, degrees):
    drones.state.body.attitude[:] = turned("roll", degrees)


def test_in_computer_vision_mode_the_picture_is_the_one_that_it_was():
    still = worlds("computer_vision")
    view = still.view(CHASE.name, **SIZE, show_drone=True)
    assert torch.equal(render_chase(still, None, **SIZE), still.render(still.state, view))


def test_of_a_level_drone_it_is_the_same_in_flight():
    flying = worlds()
    view = flying.view(CHASE.name, **SIZE, show_drone=True)
    assert torch.equal(render_chase(flying, None, **SIZE), flying.render(flying.state, view))


@pytest.mark.parametrize("mount", ["gimbal", "body"])
def test_a_drone_that_rolls_is_seen_tilted_before_a_level_horizon(mount):
    flying = worlds(mount=mount)
    view = flying.view(CHASE.name, "segmentation", **SIZE, show_drone=True)
    drone = flying.scene.geoms(SemanticClass.DRONE)
    is_drone = torch.isin(flying.render(flying.state, view)[0], torch.tensor(drone))
    level_picture = render_chase(flying, None, **SIZE)[0]
    roll(flying, 30.0)
    tilted = render_chase(flying, None, **SIZE)[0]
    differs = (tilted != level_picture).any(-1)
    assert differs.any()
    rows, columns = torch.nonzero(is_drone, as_tuple=True)
    near = torch.zeros_like(is_drone)
    near[rows.min() - 6 : rows.max() + 7, columns.min() - 6 : columns.max() + 7] = True
    assert not (differs & ~near).any()


def test_how_all_worlds_look_and_how_these_do():
    flying = worlds()
    flying.appearance = Appearance(colors={SemanticClass.GROUND: (1.0, 0.0, 0.0)})
    roll(flying, 10.0)
    below = render_chase(flying, Appearance(colors={SemanticClass.SKY: (0.0, 0.0, 1.0)}), **SIZE)[0]
    assert below[0, 0].tolist() == [0, 0, 255]
    assert below[-1, 0, 1:].tolist() == [0, 0] and below[-1, 0, 0] > 100


def test_the_camera_goes_where_it_would_be_on_a_level_drone():
    tilt, heading = turned("pitch", 20.0), turned("yaw", 40.0)
    body = product(heading, tilt)
    mounted = level(body[None], "drone/chase")
    place = torch.tensor(CHASE.pos, dtype=torch.float64)
    found = rotate(body, place + mounted.offset[0])
    assert found.tolist() == pytest.approx(rotate(heading, place).tolist())
    assert product(body, mounted.turn[0]).tolist() == pytest.approx(heading.tolist())
    assert math.isclose(float(mounted.turn.norm()), 1.0)
