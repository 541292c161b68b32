"""Advantages for learners with a critic."""

from torchrl.objectives.value import GAE

from drone_rl.config.learning import Gae
from drone_rl.config.registry import implements


@implements(Gae)
class Advantages(GAE):
    """Generalized advantage estimates (TorchRL's `GAE`) from values that the batch contains.

    Reads "state_value", ("next", "state_value") and ("next", ...) "reward", "done", "terminated";
    writes "advantage" and "value_target". Shapes: (*batch, T, 1). A step that is not
    `terminated` is bootstrapped with the value of the next state, also at the end of a row.
    """

    def __init__(
        self,
        gamma: float = Gae().gamma,
        lmbda: float = Gae().lmbda,
        scale: bool = Gae().scale,
    ) -> None:
        """Set discount rate, weight of later estimates, and whether to standardize a batch."""
        super().__init__(gamma=gamma, lmbda=lmbda, value_network=None, average_gae=scale)
