"""What an action was worth beyond what the critic expected: TorchRL's estimator, told by values."""

from torchrl.objectives.value import GAE

from drone_rl.config.learning import Gae
from drone_rl.config.registry import implements


@implements(Gae)
class Advantages(GAE):
    """Generalised advantage estimates, as `GAE` makes them of values that a batch holds.

    Reads "state_value", ("next", "state_value") and ("next", ...) "reward", "done", "terminated";
    writes "advantage" and "value_target". Shapes: (*batch, T, 1). Beyond a step that is not
    `terminated` the value of what follows counts, be the row cut there or not.
    """

    def __init__(
        self, gamma: float = Gae.gamma, lmbda: float = Gae.lmbda, scale: bool = Gae.scale
    ) -> None:
        """Sets the rates.

        Args:
            gamma: Discount rate in [0, 1].
            lmbda: Weight in [0, 1] of estimates that look one step farther; 0 looks one step.
            scale: Whether to standardise a batch's advantages.
        """
        super().__init__(gamma=gamma, lmbda=lmbda, value_network=None, average_gae=scale)
