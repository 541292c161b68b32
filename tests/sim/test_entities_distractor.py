from drone_rl.sim.entities import make_distractors
from drone_rl.sim.rendering.scene import SemanticClass


def test_distractors_cycle_through_all_shapes():
    made = make_distractors(4)
    assert [d.geom.type for d in made] == ["box", "sphere", "cylinder", "box"]
    assert all(d.semantic_class is SemanticClass.DISTRACTOR and d.geom.size[0] == 0.5 for d in made)
    assert len({d.mjcf_model.model for d in made}) == 4
