import numpy as np
from dm_control import mjcf

from drone_rl.sim.entities import Cube
from drone_rl.sim.rendering.scene import SemanticClass


def test_cube_is_a_box_without_collisions():
    cube = Cube(2.5, (0.1, 0.2, 0.3), name="cube_7")
    model = mjcf.Physics.from_mjcf_model(cube.mjcf_model).model
    assert model.geom_size[0].tolist() == [1.25] * 3  # half edges
    np.testing.assert_allclose(model.geom_rgba[0, :3], (0.1, 0.2, 0.3), atol=1e-6)
    assert not model.geom_contype.any() and not model.geom_conaffinity.any()
    assert cube.mjcf_model.model == "cube_7" and cube.semantic_class is SemanticClass.TARGET
    assert cube.geom is cube.mjcf_model.find("geom", "geom")
