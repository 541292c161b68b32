"""Pictures that cover things, made here or read from files."""

import numpy as np
import pytest
from PIL import Image

from drone_rl.sim.rendering.textures import MADE, levels, load
from drone_rl.utils.errors import InputError


@pytest.mark.parametrize("name", MADE)
def test_those_made_here_are_gray_squares_of_a_power_of_two_and_not_even(name):
    texture = load(name)
    assert texture.shape == (256, 256, 3) and texture.dtype == np.uint8
    assert (texture[..., 0] == texture[..., 2]).all()
    assert texture.std() > 5 and 150 < texture.mean() < 250


@pytest.mark.parametrize("name", MADE)
def test_they_go_on_over_their_edges(name):
    """What lies beside an edge is as like as what lies beside any other line."""
    gray = load(name)[..., 0].astype(float)
    steps = np.abs(gray - np.roll(gray, 1, 1)).mean(0)
    assert steps[0] <= steps[1:].max() + 1e-9


def test_a_checkers_quarters():
    texture = load("checker")[..., 0]
    assert (texture[:128, :128] == 255).all() and (texture[128:, 128:] == 255).all()
    assert (texture[:128, 128:] == 140).all() and (texture[128:, :128] == 140).all()


def test_a_file_is_stretched_to_a_power_of_two(tmp_path):
    path = tmp_path / "blue.png"
    Image.new("RGB", (5, 3), (10, 20, 200)).save(path)
    texture = load(str(path))
    assert texture.shape == (8, 8, 3)
    assert (texture == [10, 20, 200]).all()


@pytest.mark.parametrize(
    "content, words", [(None, "no picture"), (b"not a picture", "no picture"), (b"", "no picture")]
)
def test_what_is_no_picture_is_refused_by_name(tmp_path, content, words):
    path = tmp_path / "ground.png"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=words) as refused:
        load(str(path))
    assert str(path) in str(refused.value) and "checker" in str(refused.value)


def test_a_folder_is_no_picture(tmp_path):
    with pytest.raises(InputError, match="no picture"):
        load(str(tmp_path))


def test_a_picture_that_is_too_large_is_refused_with_its_size(tmp_path):
    path = tmp_path / "wide.png"
    Image.new("L", (4097, 1)).save(path)
    with pytest.raises(InputError, match=r"4097x1 pixels.* 4096 "):
        load(str(path))


def test_each_level_is_the_mean_of_four_texels():
    texture = np.zeros((4, 4, 3), np.uint8)
    texture[:2, :2] = [[[100, 0, 0], [100, 0, 0]], [[100, 0, 0], [100, 40, 0]]]
    rows = levels(texture)
    assert len(rows) == 16 + 4 + 1
    assert rows[16:20].tolist() == [[100, 10, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]
    assert rows[20].tolist() == [25, 2, 0]
