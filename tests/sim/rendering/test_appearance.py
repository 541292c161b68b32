import torch

from drone_rl.sim.rendering import Appearance, Texture
from drone_rl.sim.rendering.appearance import expand_color
from drone_rl.sim.rendering.scene import SemanticClass

RED = (1.0, 0.0, 0.0)
SEVERAL = torch.tensor([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 0.9]])


def test_slicing_keeps_shared_values():
    appearance = Appearance(
        colors={SemanticClass.SKY: RED, SemanticClass.TARGET: SEVERAL}, sun=SEVERAL, ambient=RED
    )
    part = appearance[1:3]
    assert part.colors[SemanticClass.SKY] == RED and part.ambient == RED
    assert torch.equal(part.colors[SemanticClass.TARGET], SEVERAL[1:3])
    assert torch.equal(part.sun, SEVERAL[1:3]) and part.sun_direction is None
    assert torch.equal(Appearance(ambient=torch.tensor(RED))[0:1].ambient, torch.tensor(RED))


def test_single_color_expands_to_all_environments():
    assert expand_color(RED, 2).tolist() == [[1, 0, 0], [1, 0, 0]]
    assert torch.equal(expand_color(SEVERAL, 3).float(), SEVERAL)
    assert expand_color(RED, 2).dtype == torch.float64


def test_lights_can_differ_by_environment():
    assert Appearance(colors={SemanticClass.SKY: RED}).lights(2) == {}
    lights = Appearance(sun=SEVERAL, sun_direction=(0.0, 3.0, -4.0)).lights(3)
    assert set(lights) == {"sun", "sun_direction"}
    assert torch.equal(lights["sun"].float(), SEVERAL)
    torch.testing.assert_close(lights["sun_direction"].float(), torch.tensor([[0, 0.6, -0.8]] * 3))


def test_over_prefers_own_values():
    below = Appearance(
        colors={SemanticClass.SKY: RED, SemanticClass.GROUND: RED}, fog_visibility=50.0, shadows=1
    )
    above = Appearance(colors={SemanticClass.SKY: (0.0, 0.0, 1.0)}, fog_visibility=10.0)
    both = above.over(below)
    assert both.colors == {SemanticClass.SKY: (0.0, 0.0, 1.0), SemanticClass.GROUND: RED}
    assert (both.fog_visibility, both.shadows, both.sun) == (10.0, 1, None)
    assert above.over(None) is above
    assert Appearance(shadows=0).over(below).shadows == 0


def test_numbers_and_textures_are_sliced():
    texture = Texture(images=("grid",), size=2.0, choice=torch.tensor([0, -1, 0]))
    appearance = Appearance(
        fog_visibility=torch.tensor([1.0, 2.0, 3.0]),
        textures={SemanticClass.GROUND: texture},
        exposure=2.0,
    )
    part = appearance[1:]
    assert part.fog_visibility.tolist() == [2.0, 3.0] and part.exposure == 2.0
    assert part.textures[SemanticClass.GROUND].choice.tolist() == [-1, 0]
    assert part.textures[SemanticClass.GROUND].size == 2.0


def test_only_flat_colors_are_plain():
    assert Appearance(
        colors={SemanticClass.SKY: RED}, shadows=torch.zeros(3), exposure=2.0
    ).is_plain
    assert not Appearance(shadows=torch.tensor([0, 1])).is_plain
    assert not Appearance(zenith=RED).is_plain and not Appearance(fog_visibility=1.0).is_plain
