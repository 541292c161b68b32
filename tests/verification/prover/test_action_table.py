"""The table of possible actions, compared with an evaluation of every image."""

from collections import OrderedDict

import numpy as np
import pytest
import torch
from torch import nn

from drone_rl.policies import PolicyNetwork
from drone_rl.verification.prover.action_table import ActionTable, runs
from drone_rl.verification.prover.bounds import Compositor, NetworkBounds
from drone_rl.verification.prover.cells import Cells
from drone_rl.verification.prover.cube_images import CameraModel

EYE = CameraModel(
    left=np.linspace(2, -2, 8), up=np.linspace(0.6, -0.6, 5), half=1.0, farthest=40.0, widest=20.0,
    bound=6.0,
)  # fmt: skip


def make(cells):
    compositor = Compositor(torch.full((5, 8), 0.2), torch.tensor([1.0, -1.0, 0.6]), nn.Identity())
    return ActionTable(
        NetworkBounds(make_network(), 1e-4), compositor, cells, np.zeros((32, 2), int)
    )


@pytest.fixture
def table():
    return make([make_cells(4.0), make_cells(9.0)])


def all_of(table):
    return np.array([[[0, len(c) - 1] for c in table.cells]])


def actions_of_all_images(table):
    """The action in each combination of cells (not bands), by painting each image."""
    near, far = table.cells
    shades = np.array([0.2, 1.0, -1.0, 0.6], np.float32)
    images = [
        shades[np.where(n > 0, n, f)]
        for f in far.images[far.first[0::2]]
        for n in near.images[near.first[0::2]]
    ]
    with torch.no_grad():
        logits = make_network()(torch.from_numpy(np.array(images))[:, None])
    return logits.argmax(-1).reshape(len(far.limits) // 2, -1).numpy()


def test_cells_have_the_action_of_their_image(table):
    table.fill(all_of(table))
    expected = actions_of_all_images(table)
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


def test_only_unknown_entries_are_filled(table):
    part = np.array([[[2, 6], [3, 4]]])
    table.fill(part)
    assert (table.table[3:5, 2:7] > 0).all()
    assert (table.table > 0).sum() == 10
    known = table.num_images
    table.fill(part)
    assert table.num_images == known
    table.fill(all_of(table))
    assert (table.table[0::2, 0::2] == 1 << actions_of_all_images(table)).all()


def test_hidden_differences_are_not_evaluated(table):
    table._record[:, 0] = 10**9
    table.fill(all_of(table))
    near, far = (c.images for c in table.cells)
    covered = np.where(near[:, None] > 0, near[:, None], far[None])
    different = len(np.unique(covered.reshape(-1, 40), axis=0))
    assert different <= table.num_images < 0.9 * len(near) * len(far)


def test_no_visible_cube():
    table = make([])
    with torch.no_grad():
        action = int(make_network()(torch.full((1, 1, 5, 8), 0.2)).argmax())
    assert table.nothing_in_sight() == 1 << action


@pytest.mark.parametrize("most", [1, 3, 10_000])
def test_runs_partition_spans(table, most):
    table.fill(all_of(table))
    spans = np.array([[[0, len(table.cells[0]) - 1], [2, 5]], [[3, 7], [6, 6]]])
    covered = np.zeros((2, *table.table.shape), int)
    for owner, ranges, bits in runs(table, spans, most):
        for who, ((a, b), (c, d)), kind in zip(owner, ranges, bits, strict=True):
            assert (table.table[c : d + 1, a : b + 1] == kind).all()
            covered[who, c : d + 1, a : b + 1] += 1
    for who, ((a, b), (c, d)) in enumerate(spans):
        assert covered[who].sum() == (b - a + 1) * (d - c + 1)
        assert (covered[who, c : d + 1, a : b + 1] == 1).all()


def test_more_threads_than_blocks(table, monkeypatch):
    name = "drone_rl.verification.prover.action_table.num_cores"
    monkeypatch.setattr(name, lambda: 100_000)
    table.fill(all_of(table))
    assert (table.table[0::2, 0::2] == 1 << actions_of_all_images(table)).all()


def make_network():
    """Return a network of 5x8 pixels whose three logits depend on where it is dark."""
    generator = torch.Generator().manual_seed(3)

    def initialise(layer, is_last):
        nn.init.normal_(layer.weight, std=0.5, generator=generator)
        nn.init.zeros_(layer.bias)

    layers = [nn.Flatten(), nn.Linear(40, 16), nn.ReLU(), nn.Linear(16, 3)]
    names = ("flatten", "hidden", "relu", "logits")
    return PolicyNetwork((1, 5, 8), OrderedDict(zip(names, layers, strict=True)), initialise).eval()


class FacesAsColors:
    """A renderer without errors whose colors are the faces."""

    def __init__(self, ahead):
        self.ahead = ahead

    def render(self, left):
        return EYE.faces(self.ahead, left.astype(float))[..., None].repeat(3, -1)

    def read(self, images):
        return images[..., 0]


def make_cells(ahead):
    return Cells(EYE, ahead, -5.0, 5.0, FacesAsColors(ahead))
