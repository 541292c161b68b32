from drone_rl.envs.fault_models import late_frames, out_of_focus
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.trust.perturbations import Condition, mount, sun_at, tint


def test_nothing_is_different_by_default():
    assert Condition() == Condition(task={}, camera={}, delay=0)
    assert Condition().dimensions == ()


def test_both_at_once():
    blurred, late = out_of_focus(1.0), late_frames(2)
    tinted, sun, moved = tint((SemanticClass.GROUND,), 0.1), sun_at(5.0), mount(degrees=3.0)
    one = Condition(
        task={"cube_size": 2.0}, appearance_changes=(tinted,), faults=(blurred,), delay=3
    )
    two = Condition(
        task={"cube_size": 3.0, "step_length": 0.5},
        camera={"horizontal_fov": 90.0},
        appearance_changes=(sun,),
        mounts=(moved,),
        faults=(late,),
        delay=1,
    )
    both = one | two
    assert both.task == {"cube_size": 3.0, "step_length": 0.5}
    assert both.camera == {"horizontal_fov": 90.0}
    assert (both.appearance_changes, both.mounts, both.faults) == (
        (tinted, sun),
        (moved,),
        (blurred, late),
    )
    assert both.delay == 3
    assert both.dimensions == (3, 0, 1)
