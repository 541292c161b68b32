"""What judges and explanations ask of a network, whoever made it."""

from torch import Tensor, nn

from drone_rl.sim.actions import MOVES, Actions


class PictureNetwork(nn.Module):
    """From pictures to what actions are chosen by; any number of leading batch dimensions.

    Of actions that are counted that is a logit for each, see `Actions.num_outputs`.
    """

    in_shape: tuple[int, ...]
    """Shape (C, H, W) of one picture."""
    actions: Actions = MOVES
    """What the outputs ask for."""
    owner: str = "the policy"
    """Whose it is, as error messages say."""
    is_differentiable: bool = True
    """Whether the logits have gradients by the pixels."""
    in_keys: tuple[str, ...] = ("pixels",)
    """Entries of a batch that `forward` takes."""

    @property
    def num_actions(self) -> int:
        """Number of outputs: logits, where actions are counted."""
        return self.actions.num_outputs

    @property
    def has_weights(self) -> bool:
        """Whether any are known, so that they can be shuffled."""
        return any(True for _ in self.parameters())

    @property
    def parts(self) -> nn.Module:
        """That within which layers are addressed by name."""
        return self

    def rescale(self, factor: Tensor, shift: Tensor) -> None:
        """Multiplies each logit and then adds to it, from now on. Shapes: (num_actions,)."""
        raise NotImplementedError

    def forward(self, pixels: Tensor) -> Tensor:
        """Pictures (*, C, H, W) to logits (*, num_actions).

        Raises:
            InputError: The pictures are of another shape than the network was built for.
        """
        raise NotImplementedError
