from drone_rl.sim.entities import Pillar
from drone_rl.sim.rendering.scene import SemanticClass


def test_pillar_is_an_upright_box_without_collisions():
    pillar = Pillar(1.2, 6.0, (0.1, 0.2, 0.3), name="pillar_3")
    geom = pillar.geom
    assert pillar.mjcf_model.model == "pillar_3" and pillar.semantic_class is SemanticClass.OBSTACLE
    assert geom.size.tolist() == [0.6, 0.6, 3.0] and geom.type == "box"
    assert geom.rgba.tolist() == [0.1, 0.2, 0.3, 1.0]
    assert (geom.contype, geom.conaffinity) == (0, 0)
