"""How fast the machine is, in what is none of the program's: the network alone on whole batches."""

import statistics
import time

import torch

from drone_rl.policies import PolicyNetwork

ASKED_FOR = 148_000
"""Pictures a second that the default's network did where the figures for proofs were asked."""
_BATCH, _TIMES = 1024, 15


@torch.no_grad()
def network_pictures_per_s(network: PolicyNetwork, shape: tuple[int, ...]) -> float:
    """Pictures a second that a network looks at, with as many threads as torch takes.

    Args:
        network: Any.
        shape: Of one picture, (C, H, W).
    """
    pictures, seconds = torch.rand(_BATCH, *shape), []
    for _ in range(_TIMES):
        begin = time.perf_counter()
        network(pictures)
        seconds.append(time.perf_counter() - begin)
    return _BATCH / statistics.median(seconds)
