"""Refusal of outputs that are no numbers."""

from torch import Tensor

from drone_rl.utils.errors import InputError


def require_finite(outputs: Tensor, owner: str = "the policy") -> None:
    """Check what a network gives.

    Args:
        outputs: Any shape.
        owner: Whose they are, for the message.

    Raises:
        InputError: One is infinite or NaN.
    """
    is_finite = outputs.isfinite()
    if bool(is_finite.all()):
        return
    value = float(outputs.detach()[~is_finite][0])
    frames = int((~is_finite.reshape(-1, outputs.shape[-1]).all(-1)).sum())
    observations = "an observation" if frames == 1 else f"{frames} observations"
    raise InputError(
        f"{owner} gives non-finite action logits ({value:g}) for {observations}; its weights are "
        "too large for float32, so train it again or give another policy"
    )
