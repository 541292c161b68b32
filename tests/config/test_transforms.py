"""Shapes and types of transformed images."""

import pytest

from drone_rl.config.transforms import Fault, Frame, Transform
from drone_rl.envs import CameraFault
from drone_rl.utils.errors import InputError

RGB, GRAY = Frame((25, 64, 3)), Frame((1, 25, 64), True)


@pytest.mark.parametrize(
    ("name", "values", "picture", "after"),
    [
        ("gray", {}, RGB, Frame((1, 25, 64), True)),
        ("rgb", {}, RGB, Frame((3, 25, 64), True)),
        ("chromaticity", {"floor": 0.1}, Frame((3, 25, 64), True), Frame((2, 25, 64), True)),
        ("standardize", {}, Frame((1, 25, 64)), Frame((1, 25, 64), True)),
        ("crop", {"top": 5, "bottom": 20}, Frame((1, 25, 64), True), Frame((1, 15, 64), True)),
        ("resize", {"height": 4, "width": 9}, Frame((2, 5, 5), True), Frame((2, 4, 9), True)),
        ("stack", {"N": 3}, Frame((2, 5, 5), True), Frame((6, 5, 5), True)),
        ("step_count", {}, RGB, RGB),
        ("blur", {"width": 1.0}, GRAY, GRAY),
        ("noise", {"strength": 0.1, "correlation_time": 0.0}, GRAY, GRAY),
        ("dead_rows", {"count": 23, "rows": (0, 24), "level": 0.0}, GRAY, GRAY),
        ("frozen_frames", {"share": 0.5}, GRAY, GRAY),
        ("held_frames", {"every": 3}, GRAY, GRAY),
        ("late_frames", {"frames": 2}, GRAY, GRAY),
        ("shift", {"down": 1, "across": 2}, GRAY, GRAY),
    ],
)
def test_output_shapes(name, values, picture, after):
    assert Transform.read({"name": name, **values}).output(picture) == after


def test_faults_are_those_by_chance_or_with_memory():
    faults = {v.name for v in Transform.registry.values() if issubclass(v, Fault)}
    assert faults == {
        *("noise", "bias", "dead_rows", "frozen_frames", "held_frames", "late_frames", "shift")
    }
    assert all(issubclass(variant.factory, CameraFault) for variant in Fault.__subclasses__())


@pytest.mark.parametrize(
    ("name", "frame", "message"),
    [
        ("gray", Frame((3, 25, 64), True), "gray needs the camera's bytes"),
        ("gray", Frame((25, 64, 3), True), "gray needs the camera's bytes"),
        ("rgb", Frame((25, 64, 1)), "rgb needs the camera's bytes"),
        ("chromaticity", Frame((4, 25, 64), True), "chromaticity needs three colors"),
        ("chromaticity", Frame((2, 25, 64), True), "chromaticity needs three colors"),
        ("chromaticity", Frame((3, 25, 64)), "chromaticity needs three colors"),
        ("crop", RGB, "crop needs channels first; put gray or rgb before it"),
    ],
)
def test_images_of_another_kind_are_refused(name, frame, message):
    with pytest.raises(InputError, match=message):
        Transform.read(name).output(frame)
