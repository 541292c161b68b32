"""The parts that files can name, and what they make of a picture."""

import pytest

from drone_rl.settings.networks import Network
from drone_rl.settings.transforms import Transform
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import kinds_of, snake_case
from drone_rl.zoo.registry import NETWORKS, TRANSFORMS, Picture, find_part

RGB = Picture((25, 64, 3))


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
        ("standardize", {}, Picture((1, 25, 64)), Picture((1, 25, 64), True)),
        ("crop", {"top": 5, "bottom": 20}, Picture((1, 25, 64), True), Picture((1, 15, 64), True)),
        ("resize", {"height": 4, "width": 9}, Picture((2, 5, 5), True), Picture((2, 4, 9), True)),
        ("stack", {"N": 3}, Picture((2, 5, 5), True), Picture((6, 5, 5), True)),
        ("step_count", {}, RGB, RGB),
    ],
)
def test_what_becomes_of_a_picture(name, values, picture, after):
    assert TRANSFORMS[name].change(picture, values) == after


def test_a_name_that_nobody_registered():
    with pytest.raises(InputError, match=r"network\.name='x' is unknown; there are: small_cnn"):
        find_part(NETWORKS, "x", "network.name")
