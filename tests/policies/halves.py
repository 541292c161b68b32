"""Networks and pictures to try gradients by.

Numbers are halves of -1, 0 and 1, so that sums are the same in any order: nothing but a mistake can
put an output on the other side of 0.
"""

import torch

from drone_rl.policies import SmallCNN


def made(shape=(1, 12, 20), **options):
    network = SmallCNN(shape, 3, **options)
    draw_weights(network)
    return network


@torch.no_grad()
def draw_weights(network):
    for parameter in network.parameters():
        parameter.copy_(halves(*parameter.shape))


def halves(*shape):
    return torch.randint(-1, 2, shape) / 2


def taught(network, by, pictures, weights):
    """Logits by a network, and the gradients that this leaves."""
    network.zero_grad()
    logits = by(pictures)
    (logits * weights).sum().backward()
    return logits.detach(), [p.grad.clone() for p in network.parameters()]
