import numpy as np
from dm_control import mjcf

from drone_rl.sim.entities import DRAW_DISTANCE, FLOOR_COLOR, SKY_COLOR, Field
from drone_rl.sim.rendering.scene import SemanticClass


def test_arena_has_a_floor_and_a_sun_without_shadows():
    field = Field()
    model = mjcf.Physics.from_mjcf_model(field.mjcf_model).model
    assert (model.ngeom, model.nlight) == (1, 1) and field.semantic_class is SemanticClass.GROUND
    np.testing.assert_allclose(model.geom("floor").rgba[:3], FLOOR_COLOR, atol=1e-6)
    assert not model.light_castshadow[0] and model.light_dir[0, 2] < -0.5  # from above
    np.testing.assert_allclose(model.light_ambient[0] + 0.75, 1.1)  # full light is white


def test_floor_is_wide_and_sky_opaque():
    model = mjcf.Physics.from_mjcf_model(Field().mjcf_model).model
    assert model.geom("floor").size.tolist() == [300.0, 300.0, 100.0]
    assert model.vis.rgba.haze.tolist()[3] == 1.0
    np.testing.assert_allclose(model.vis.rgba.haze[:3], SKY_COLOR, atol=1e-6)
    assert model.vis.map.zfar == DRAW_DISTANCE == 200.0 and model.stat.extent == 1.0
