"""The table of possible actions, against looking at every picture."""

import numpy as np
import pytest
import torch
from torch import nn

from drone_rl.verification.prover.action_table import Outlook, runs
from drone_rl.verification.prover.bounds import Bounds, Painter
from drone_rl.verification.prover.cells import Cells
from drone_rl.verification.prover.cube_images import Eye

EYE = Eye(
    left=np.linspace(2, -2, 8), up=np.linspace(0.6, -0.6, 5), half=1.0, farthest=40.0, widest=20.0,
    bound=6.0,
)  # fmt: skip


class Network(nn.Module):
    """Three logits of a picture of 5x8 pixels, which depend on where it is dark."""

    def __init__(self):
        super().__init__()
        generator = torch.Generator().manual_seed(3)
        hidden, last = nn.Linear(40, 16), nn.Linear(16, 3)
        for layer in (hidden, last):
            nn.init.normal_(layer.weight, std=0.5, generator=generator)
            nn.init.zeros_(layer.bias)
        self.layers = nn.Sequential(nn.Flatten(), hidden, nn.ReLU(), last)

    def forward(self, pictures):
        return self.layers(pictures)


def make(cells):
    painter = Painter(torch.full((5, 8), 0.2), torch.tensor([1.0, -1.0, 0.6]))
    return Outlook(Bounds(Network().eval(), 1e-4), painter, cells, np.zeros((32, 2), int))


@pytest.fixture
def outlook():
    return make([Cells(EYE, 4.0, -5.0, 5.0), Cells(EYE, 9.0, -5.0, 5.0)])


def all_of(outlook):
    return np.array([[[0, len(c) - 1] for c in outlook.cells]])


def looked_at(outlook):
    """The action in each combination of cells (not bands), by painting each picture."""
    near, far = outlook.cells
    shades = np.array([0.2, 1.0, -1.0, 0.6], np.float32)
    pictures = [
        shades[np.where(n > 0, n, f)]
        for f in far.pictures[far.first[0::2]]
        for n in near.pictures[near.first[0::2]]
    ]
    with torch.no_grad():
        logits = Network()(torch.from_numpy(np.array(pictures)))
    return logits.argmax(-1).reshape(len(far.limits) // 2, -1).numpy()


def test_cells_have_the_action_of_their_picture(outlook):
    outlook.fill(all_of(outlook))
    expected = looked_at(outlook)
    assert (outlook.table[0::2, 0::2] == 1 << expected).all()
    assert len(np.unique(expected)) > 1  # else it says nothing
    assert outlook.pictures < 4 * expected.size
    assert 0 < outlook.least_gap < 10


def test_bands_have_the_actions_of_both_sides(outlook):
    outlook.fill(all_of(outlook))
    t = outlook.table
    assert (t[0::2, 1::2] == t[0::2, 0:-1:2] | t[0::2, 2::2]).all()
    assert (t[1::2, 0::2] == t[0:-1:2, 0::2] | t[2::2, 0::2]).all()
    corners = t[0:-1:2, 0:-1:2] | t[0:-1:2, 2::2] | t[2::2, 0:-1:2] | t[2::2, 2::2]
    assert (t[1::2, 1::2] == corners).all()


def test_only_what_is_asked_for_is_filled_and_only_once(outlook):
    part = np.array([[[2, 6], [3, 4]]])
    outlook.fill(part)
    assert (outlook.table[3:5, 2:7] > 0).all()
    assert (outlook.table > 0).sum() == 10
    known = outlook.pictures
    outlook.fill(part)
    assert outlook.pictures == known
    outlook.fill(all_of(outlook))
    assert (outlook.table[0::2, 0::2] == 1 << looked_at(outlook)).all()


def test_what_several_ask_for_is_looked_at_once(outlook):
    outlook._record[:, 0] = 10**9  # bounds seem to be of no use
    near, far = ((len(c) - 1) // 2 * 2 for c in outlook.cells)
    outlook.fill(np.array([[[0, near], [0, 0]], [[0, 0], [0, far]], [[0, near], [0, 2]]]))
    a, b = outlook.cells[0].last[near] + 1, outlook.cells[1].last[far] + 1
    c = outlook.cells[1].last[2] + 1
    assert 0.5 * (a * c + b - c) < outlook.pictures <= a * c + b - c  # some are hidden


def test_what_is_hidden_is_not_looked_at_again(outlook):
    outlook._record[:, 0] = 10**9
    outlook.fill(all_of(outlook))
    near, far = (c.pictures for c in outlook.cells)
    seen = np.where(near[:, None] > 0, near[:, None], far[None])
    different = len(np.unique(seen.reshape(-1, 40), axis=0))
    assert different <= outlook.pictures < 0.9 * len(near) * len(far)


def test_nothing_in_sight():
    outlook = make([])
    with torch.no_grad():
        action = int(Network()(torch.full((1, 5, 8), 0.2)).argmax())
    assert outlook.nothing_in_sight() == 1 << action


@pytest.mark.parametrize("most", [1, 3, 10_000])
def test_runs_are_a_partition_into_one_kind_each(outlook, most):
    outlook.fill(all_of(outlook))
    spans = np.array([[[0, len(outlook.cells[0]) - 1], [2, 5]], [[3, 7], [6, 6]]])
    seen = np.zeros((2, *outlook.table.shape), int)
    for owner, ranges, bits in runs(outlook, spans, most):
        for who, ((a, b), (c, d)), kind in zip(owner, ranges, bits, strict=True):
            assert (outlook.table[c : d + 1, a : b + 1] == kind).all()
            seen[who, c : d + 1, a : b + 1] += 1
    for who, ((a, b), (c, d)) in enumerate(spans):
        assert seen[who].sum() == (b - a + 1) * (d - c + 1)
        assert (seen[who, c : d + 1, a : b + 1] == 1).all()


def test_runs_of_one_cube():
    outlook = make([Cells(EYE, 4.0, -5.0, 5.0)])
    spans = all_of(outlook)
    outlook.fill(spans)
    ((_, ranges, bits),) = runs(outlook, spans, 100)
    assert (bits[1:] != bits[:-1]).all()
    assert ranges[:, 0].tolist()[0][0] == 0 and ranges[-1, 0, 1] == len(outlook.cells[0]) - 1
