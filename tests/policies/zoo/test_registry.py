"""The parts that files can name, and what they make of a picture."""

import pytest

from drone_rl.config.networks import Network
from drone_rl.config.transforms import Fault, Transform
from drone_rl.policies.zoo.registry import NETWORKS, TRANSFORMS, Picture, find_part
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import kinds_of, snake_case

RGB, GRAY = Picture((25, 64, 3)), Picture((1, 25, 64), True)


@pytest.mark.parametrize(("parts", "part"), [(NETWORKS, Network), (TRANSFORMS, Transform)])
def test_every_variant_can_be_named_by_a_file_within_the_bounds_of_its_settings(parts, part):
    for variant in part.variants():
        if variant.__module__.startswith("drone_rl"):
            registered = parts[snake_case(variant)]
            assert registered.parameters.fields == kinds_of(variant)
            assert variant.target in registered.targets


@pytest.mark.parametrize(
    ("name", "values", "picture", "after"),
    [
        ("gray", {}, RGB, Picture((1, 25, 64), True)),
        ("rgb", {}, RGB, Picture((3, 25, 64), True)),
        ("chromaticity", {"floor": 0.1}, Picture((3, 25, 64), True), Picture((2, 25, 64), True)),
        ("standardize", {}, Picture((1, 25, 64)), Picture((1, 25, 64), True)),
        ("crop", {"top": 5, "bottom": 20}, Picture((1, 25, 64), True), Picture((1, 15, 64), True)),
        ("resize", {"height": 4, "width": 9}, Picture((2, 5, 5), True), Picture((2, 4, 9), True)),
        ("stack", {"N": 3}, Picture((2, 5, 5), True), Picture((6, 5, 5), True)),
        ("step_count", {}, RGB, RGB),
        ("blur", {"width": 1.0}, GRAY, GRAY),
        ("noise", {"strength": 0.1, "correlation_time": 0.0}, GRAY, GRAY),
        ("dead_rows", {"count": 23, "rows": (0, 24), "level": 0.0}, GRAY, GRAY),
        ("frozen_frames", {"share": 0.5}, GRAY, GRAY),
        ("late_frames", {"frames": 2}, GRAY, GRAY),
        ("shift", {"down": 1, "across": 2}, GRAY, GRAY),
    ],
)
def test_what_becomes_of_a_picture(name, values, picture, after):
    assert TRANSFORMS[name].change(picture, values) == after


def test_a_name_that_nobody_registered():
    with pytest.raises(InputError, match=r"network\.name='x' is unknown; there are: small_cnn"):
        find_part(NETWORKS, "x", "network.name")


_OF_FLOATS = ["blur", "noise", "dead_rows", "frozen_frames", "late_frames", "shift"]


@pytest.mark.parametrize("name", _OF_FLOATS)
def test_what_goes_wrong_in_a_camera_goes_wrong_with_floats(name):
    with pytest.raises(InputError, match=f"{name} needs floats; let gray come first"):
        TRANSFORMS[name].change(RGB, {"count": 0, "rows": (), "level": 0.0})


def test_faults_are_those_by_chance_or_with_memory():
    faults = {name for name, part in TRANSFORMS.items() if part.is_fault}
    assert faults == {"noise", "dead_rows", "frozen_frames", "late_frames", "shift"}
    assert faults == {snake_case(variant) for variant in Fault.variants()}
