import numpy as np
import torch

from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import Pillars


def test_there_is_a_prop_for_each_pillar(settings):
    task = Pillars(settings)
    props = task.make_props()
    assert len(props) == 4 and {prop.semantic_class for prop in props} == {SemanticClass.OBSTACLE}
    assert len({prop.mjcf_model.model for prop in props}) == 4


def test_what_does_not_stand_is_out_of_sight(settings, field):
    state = field((5.0, -5.0), (5.0, -5.0))
    state.present[0, 2] = False
    z = Pillars(settings).places(state)[0, :, 2]
    assert z.tolist() == [3.0, 3.0, -97.0, 3.0]


def test_the_information_is_that_of_the_entries(settings, field):
    task = Pillars(settings)
    info = task.info(field((5.0, -5.0), (1.5, -5.0)))
    assert set(info) == set(task.entries)
    for name, entry in task.entries.items():
        assert (info[name].shape[1:], info[name].dtype) == (entry.shape, entry.dtype), name
    assert info["rows"].tolist() == [[[5.0, -5.0], [1.5, -5.0]]]


def test_fields_are_drawn_from_the_world_s_own_stream(settings):
    task = Pillars(settings)
    one, two = (task.draw(np.random.RandomState(3)) for _ in range(2))
    assert one.shape == (2, 2) and torch.equal(one, two) and one.dtype == torch.float64


def test_bounds_of_what_is_reported(settings):
    entries = Pillars(settings).entries
    bounds = {name: (entry.low, entry.high) for name, entry in entries.items()}
    assert bounds["side"] == (-1, 2)  # not known yet, or one of three
    assert bounds["next_row"] == (0, 2)
    assert bounds["end_reason"] == (0, 5)
