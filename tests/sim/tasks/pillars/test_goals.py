import torch

from drone_rl.config import PillarsSettings
from drone_rl.sim.tasks import Pillars
from drone_rl.sim.tasks.pillars.goals import RowGoals, classes, gap_edges


def test_classes_of_gaps_begin_at_the_drone():
    assert gap_edges(PillarsSettings()) == [0.8, 1.8, 3.8]


def test_rows_fall_into_classes(settings):
    goals = RowGoals(
        reached=torch.tensor([[True, False]]),
        stratum=torch.tensor([[2, 1]]),
        world=torch.zeros(1, 4),
        gap=torch.tensor([[1.0, 9.0]]).double(),
    )
    found = {(by, value): of[0].tolist() for by, value, of in classes(settings, goals)}
    assert found == {
        ("row", "first"): [True, False],
        ("row", "second"): [False, True],
        ("side", "left"): [False, False],
        ("side", "ahead"): [False, True],
        ("side", "right"): [True, False],
        ("gap", "0.8 to 1.8 m"): [True, False],
        ("gap", "1.8 to 3.8 m"): [False, False],
        ("gap", "more than 3.8 m"): [False, True],
    }


def test_goals_are_made_of_the_last_information(settings):
    info = {
        "passed": torch.tensor([[True, False]]),
        "side": torch.tensor([[2, -1]]),
        "gap": torch.tensor([[1.5, torch.nan]]).double(),
        "rows": torch.tensor([[[1.0, 2.0], [3.0, 4.0]]]),
    }
    goals = Pillars(settings).score(info)
    assert goals.reached.tolist() == [[True, False]] and goals.stratum.tolist() == [[2, -1]]
    assert goals.world.tolist() == [[1, 2, 3, 4]] and goals.gap[0, 0] == 1.5
