from drone_rl.robustness.faults import Blur, Late
from drone_rl.robustness.perturbations import Condition, Mount, SunAt, Tinted
from drone_rl.sim.rendering.scene import SemanticClass


def test_nothing_is_different_by_default():
    assert Condition() == Condition(task={}, camera={}, delay=0)
    assert Condition().dimensions == ()


def test_both_at_once():
    blur, late = Blur(1.0), Late(2)
    tint, sun, mount = Tinted((SemanticClass.GROUND,), 0.1), SunAt(5.0), Mount(degrees=3.0)
    one = Condition(task={"cube_size": 2.0}, looks=(tint,), faults=(blur,), delay=3)
    two = Condition(
        task={"cube_size": 3.0, "step_length": 0.5},
        camera={"horizontal_fov": 90.0},
        looks=(sun,),
        mounts=(mount,),
        faults=(late,),
        delay=1,
    )
    both = one | two
    assert both.task == {"cube_size": 3.0, "step_length": 0.5}
    assert both.camera == {"horizontal_fov": 90.0}
    assert (both.looks, both.mounts, both.faults) == ((tint, sun), (mount,), (blur, late))
    assert both.delay == 3
    assert both.dimensions == (3, 0, 1)
