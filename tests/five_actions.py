"""A set of five actions with two pairs of opposites and one mirrored pair."""

from drone_rl.sim.actions import DiscreteActions

FIVE = DiscreteActions(
    names=("up", "down", "left", "right", "stay"),
    mirrored=(0, 1, 3, 2, 4),
    opposite=(1, 0, 3, 2, 4),
    left=2,
    order=(2, 0, 4, 1, 3),
    arrows=((0, 1), (0, -1), (-1, 0), (1, 0), (0, 0)),
    colors=((0, 0, 0),) * 5,
)
