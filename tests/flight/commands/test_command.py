import torch

from drone_rl.flight.commands.command import HOLD, Command, goals_of, hold
from drone_rl.sim.dynamics import Mode


class Nothing(Command):
    def goals(self, body):
        return hold(body.reference)


def test_it_is_never_done_by_itself(hovering):
    body = hovering((0, 0, 1), (0, 0, 2))
    command = Nothing()
    assert command.is_complete(body).tolist() == [False, False]
    assert command.rest(body) is None
    assert not command.succeeds_at_limit


def test_goals_of_numbers_and_tensors(hovering):
    body = hovering((0, 0, 1), (0, 0, 2))
    goals = goals_of(body, HOLD, 1.0, torch.tensor([2.0, 3.0]), 0.5, body.position[:, 2])
    assert goals.values.tolist() == [[1, 2, 0.5, 1], [1, 3, 0.5, 2]]
    assert goals.modes == (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.POSITION)
