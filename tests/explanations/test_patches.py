import dataclasses
import math

import pytest
import torch

from drone_rl.explanations.patches import Grid, make_grid, replaced
from drone_rl.policies import MLP


@pytest.mark.parametrize(
    ("size", "patches"),
    [((25, 64), (5, 8, 5, 8)), ((36, 64), (7, 8, 5, 8)), ((100, 256), (25, 25, 4, 10))],
)
def test_about_forty_patches_of_one_size(size, patches):
    grid = make_grid(*size)
    assert (grid.height, grid.width, grid.rows, grid.columns) == patches


@pytest.mark.parametrize("size", [(25, 64), (13, 32), (38, 96), (8, 8), (1, 7), (3, 200)])
def test_patches_are_equal_apart_and_inside(size):
    grid = make_grid(*size)
    masks = grid.masks(size)
    assert masks.flatten(1).sum(1).unique().tolist() == [grid.height * grid.width]
    assert masks.sum(0).max() == 1
    assert masks.sum() > 0.85 * size[0] * size[1]
    assert min(20, size[0] * size[1]) <= grid.count <= 64 or size == (1, 7)


SIZES = [(25, 64), (13, 32), (38, 96), (8, 8), (1, 7), (7, 1), (3, 200), (37, 65), (43, 111)]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("patches", [40, 12])
def test_no_grid_is_better(size, patches):
    """What is lost weighs 4, a wrong number 1 and a long patch half, each as a logarithm."""
    height, width = size

    def cost(grid):
        covered = grid.count * grid.height * grid.width / (height * width)
        wrong, long = math.log(grid.count / patches), math.log(grid.width / grid.height)
        return 4 * (1 - covered) + abs(wrong) + 0.5 * abs(long)

    all_grids = [
        Grid(height // rows, width // columns, rows, columns)
        for rows in range(1, height + 1)
        for columns in range(1, width + 1)
        if rows * columns <= 2 * patches
    ]
    found = make_grid(height, width, patches)
    assert cost(found) == pytest.approx(min(map(cost, all_grids)))
    assert found.top == (height - found.rows * found.height) // 2
    assert found.left == (width - found.columns * found.width) // 2


def test_what_does_not_fit_is_left_out_on_both_sides():
    assert Grid(2, 2, 1, 2, top=1, left=1).span(1) == (slice(1, 3), slice(3, 5))
    masks = Grid(2, 2, 1, 2, top=1, left=1).masks((4, 6))
    assert masks[1].nonzero().tolist() == [[1, 3], [1, 4], [2, 3], [2, 4]]


def test_a_grid_is_a_fact():
    with pytest.raises(dataclasses.FrozenInstanceError):
        make_grid(25, 64).rows = 3


def test_means_by_hand():
    maps = torch.tensor([[[1.0, 3.0, 0.0, 0.0], [5.0, 7.0, 0.0, 2.0]]])
    assert Grid(2, 2, 1, 2).means(maps).tolist() == [[4.0, 0.5]]


def test_only_parts_that_differ_are_tried_and_only_they_change():
    network = MLP((1, 2, 2), 2, hidden=())
    with torch.no_grad():
        network.layers.logits.weight.copy_(torch.tensor([[0.0] * 4, [1.0, 2.0, 4.0, 8.0]]))
    x, other = torch.zeros(2, 1, 2, 2), torch.zeros(2, 1, 2, 2)
    other[0, 0, 0, 1] = 1.0  # in picture 0 the first row differs, in picture 1 nothing does
    other[1, 0, 1, 0] = 0.0
    masks = Grid(1, 2, 2, 1).masks((2, 2))
    ((frames, parts, after),) = replaced(network, x, other, masks)
    assert (frames.tolist(), parts.tolist()) == ([0], [0])
    assert after[0, 1].item() == pytest.approx(torch.sigmoid(torch.tensor(2.0)).item())
