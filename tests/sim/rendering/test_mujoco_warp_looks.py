"""The model while an appearance is applied and after it is removed."""

import mujoco
import mujoco_warp as mjw
import pytest
import torch
import warp as wp

from drone_rl.sim.rendering import Appearance, Scene
from drone_rl.sim.rendering.mujoco_warp import ModelAppearance
from drone_rl.sim.rendering.scene import SemanticClass

XML = """<mujoco><worldbody><light directional="true" ambient=".1 .1 .1" diffuse=".5 .5 .5"/>
<geom name="a" type="plane" size="1 1 1" rgba=".2 .4 .6 1"/>
<geom name="b" size="1" rgba=".1 .1 .1 1"/></worldbody></mujoco>"""


@pytest.fixture
def applied():
    """Return the ModelAppearance of three environments and a reader of model values."""
    model = mujoco.MjModel.from_xml_string(XML)
    scene = Scene(model, (SemanticClass.GROUND, SemanticClass.TARGET), (-1, 0), (0.0, 0.0, 0.0))
    with wp.ScopedDevice("cpu"):
        warped = mjw.put_model(model)
        appearance = ModelAppearance(scene, warped, 3)
    return appearance, lambda name: wp.to_torch(getattr(warped, name))


def test_each_environment_starts_with_the_models_appearance(applied):
    _, values = applied
    assert values("geom_rgba").shape == (3, 2, 4)
    torch.testing.assert_close(values("geom_rgba")[:, 0], torch.tensor([[0.2, 0.4, 0.6, 1.0]] * 3))
    assert values("light_diffuse").flatten().tolist() == [0.5] * 9


def test_colors_are_set_by_semantic_class_and_reset(applied):
    appearance, values = applied
    ground = torch.tensor([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    appearance.apply(
        Appearance(colors={SemanticClass.GROUND: ground, SemanticClass.SKY: (0.5, 0.5, 0.5)}), 2
    )
    rgba = values("geom_rgba")
    assert rgba[:2, 0, :3].tolist() == ground.tolist() and (rgba[..., 3] == 1).all()
    torch.testing.assert_close(rgba[2, 0, :3], torch.tensor([0.2, 0.4, 0.6]))  # not applied
    torch.testing.assert_close(rgba[:, 1, :3], torch.full((3, 3), 0.1))
    appearance.apply(None, 3)
    torch.testing.assert_close(rgba[:, 0, :3], torch.tensor([[0.2, 0.4, 0.6]] * 3))


def test_appearance_replaces_the_previous_one(applied):
    appearance, values = applied
    appearance.apply(
        Appearance(colors={SemanticClass.TARGET: (1.0, 1.0, 1.0)}, sun=(0.0, 0.0, 0.0)), 3
    )
    appearance.apply(Appearance(ambient=(0.9, 0.9, 0.9)), 3)
    torch.testing.assert_close(values("geom_rgba")[:, 1, :3], torch.full((3, 3), 0.1))
    assert values("light_diffuse").flatten().tolist() == [0.5] * 9
    torch.testing.assert_close(values("light_ambient").flatten(), torch.full((9,), 0.9))


def test_light_direction_is_normalized(applied):
    appearance, values = applied
    appearance.apply(Appearance(sun_direction=(0.0, 3.0, -4.0)), 1)
    torch.testing.assert_close(values("light_dir")[0, 0], torch.tensor([0.0, 0.6, -0.8]))
