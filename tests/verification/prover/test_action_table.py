"""The table of possible actions, against looking at every image."""

import numpy as np
import pytest
import torch
from torch import nn

from drone_rl.verification.prover.action_table import ActionTable, runs
from drone_rl.verification.prover.bounds import Compositor, NetworkBounds
from drone_rl.verification.prover.cells import Cells
from drone_rl.verification.prover.cube_images import CameraModel

EYE = CameraModel(
    left=np.linspace(2, -2, 8), up=np.linspace(0.6, -0.6, 5), half=1.0, farthest=40.0, widest=20.0,
    bound=6.0,
)  # fmt: skip


class Network(nn.Module):
    """Three logits of an image of 5x8 pixels, which depend on where it is dark."""

    def __init__(self):
        super().__init__()
        generator = torch.Generator().manual_seed(3)
        hidden, last = nn.Linear(40, 16), nn.Linear(16, 3)
        for layer in (hidden, last):
            nn.init.normal_(layer.weight, std=0.5, generator=generator)
            nn.init.zeros_(layer.bias)
        self.layers = nn.Sequential(nn.Flatten(), hidden, nn.ReLU(), last)

    def forward(self, images):
        return self.layers(images)


def make(cells):
    compositor = Compositor(torch.full((5, 8), 0.2), torch.tensor([1.0, -1.0, 0.6]))
    return ActionTable(
        NetworkBounds(Network().eval(), 1e-4), compositor, cells, np.zeros((32, 2), int)
    )


@pytest.fixture
def table():
    return make([Cells(EYE, 4.0, -5.0, 5.0), Cells(EYE, 9.0, -5.0, 5.0)])


def all_of(table):
    return np.array([[[0, len(c) - 1] for c in table.cells]])


def looked_at(table):
    """The action in each combination of cells (not bands), by painting each image."""
    near, far = table.cells
    shades = np.array([0.2, 1.0, -1.0, 0.6], np.float32)
    images = [
        shades[np.where(n > 0, n, f)]
        for f in far.images[far.first[0::2]]
        for n in near.images[near.first[0::2]]
    ]
    with torch.no_grad():
        logits = Network()(torch.from_numpy(np.array(images)))
    return logits.argmax(-1).reshape(len(far.limits) // 2, -1).numpy()


def test_cells_have_the_action_of_their_picture(table):
    table.fill(all_of(table))
    expected = looked_at(table)
    assert (table.table[0::2, 0::2] == 1 << expected).all()
    assert len(np.unique(expected)) > 1  # else it says nothing
    assert table.num_images < 4 * expected.size
    assert 0 < table.least_gap < 10


def test_bands_have_the_actions_of_both_sides(table):
    table.fill(all_of(table))
    t = table.table
    assert (t[0::2, 1::2] == t[0::2, 0:-1:2] | t[0::2, 2::2]).all()
    assert (t[1::2, 0::2] == t[0:-1:2, 0::2] | t[2::2, 0::2]).all()
    corners = t[0:-1:2, 0:-1:2] | t[0:-1:2, 2::2] | t[2::2, 0:-1:2] | t[2::2, 2::2]
    assert (t[1::2, 1::2] == corners).all()


def test_only_what_is_asked_for_is_filled_and_only_once(table):
    part = np.array([[[2, 6], [3, 4]]])
    table.fill(part)
    assert (table.table[3:5, 2:7] > 0).all()
    assert (table.table > 0).sum() == 10
    known = table.num_images
    table.fill(part)
    assert table.num_images == known
    table.fill(all_of(table))
    assert (table.table[0::2, 0::2] == 1 << looked_at(table)).all()


def test_what_several_ask_for_is_looked_at_once(table):
    table._record[:, 0] = 10**9  # bounds seem to be of no use
    near, far = ((len(c) - 1) // 2 * 2 for c in table.cells)
    table.fill(np.array([[[0, near], [0, 0]], [[0, 0], [0, far]], [[0, near], [0, 2]]]))
    a, b = table.cells[0].last[near] + 1, table.cells[1].last[far] + 1
    c = table.cells[1].last[2] + 1
    assert 0.5 * (a * c + b - c) < table.num_images <= a * c + b - c  # some are hidden


def test_what_is_hidden_is_not_looked_at_again(table):
    table._record[:, 0] = 10**9
    table.fill(all_of(table))
    near, far = (c.images for c in table.cells)
    seen = np.where(near[:, None] > 0, near[:, None], far[None])
    different = len(np.unique(seen.reshape(-1, 40), axis=0))
    assert different <= table.num_images < 0.9 * len(near) * len(far)


def test_nothing_in_sight():
    table = make([])
    with torch.no_grad():
        action = int(Network()(torch.full((1, 5, 8), 0.2)).argmax())
    assert table.nothing_in_sight() == 1 << action


@pytest.mark.parametrize("most", [1, 3, 10_000])
def test_runs_are_a_partition_into_one_kind_each(table, most):
    table.fill(all_of(table))
    spans = np.array([[[0, len(table.cells[0]) - 1], [2, 5]], [[3, 7], [6, 6]]])
    seen = np.zeros((2, *table.table.shape), int)
    for owner, ranges, bits in runs(table, spans, most):
        for who, ((a, b), (c, d)), kind in zip(owner, ranges, bits, strict=True):
            assert (table.table[c : d + 1, a : b + 1] == kind).all()
            seen[who, c : d + 1, a : b + 1] += 1
    for who, ((a, b), (c, d)) in enumerate(spans):
        assert seen[who].sum() == (b - a + 1) * (d - c + 1)
        assert (seen[who, c : d + 1, a : b + 1] == 1).all()


def test_runs_of_one_cube():
    table = make([Cells(EYE, 4.0, -5.0, 5.0)])
    spans = all_of(table)
    table.fill(spans)
    ((_, ranges, bits),) = runs(table, spans, 100)
    assert (bits[1:] != bits[:-1]).all()
    assert ranges[:, 0].tolist()[0][0] == 0 and ranges[-1, 0, 1] == len(table.cells[0]) - 1


def test_more_cores_than_blocks(table, monkeypatch):
    """There are up to 65 images at a time here, just too many for one thread."""
    name = "drone_rl.verification.prover.action_table.num_cores"
    monkeypatch.setattr(name, lambda: 100_000)
    monkeypatch.setattr("drone_rl.verification.prover.action_table.ALONE", 1)
    table.fill(all_of(table))
    assert (table.table[0::2, 0::2] == 1 << looked_at(table)).all()
