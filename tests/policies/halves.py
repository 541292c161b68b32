"""Networks and images for tests of gradients.

Values are multiples of 1/2 from -1/2 to 1/2, so sums are exact in any order and rounding cannot
change the sign of an output.
"""

import torch

from drone_rl.policies import SmallCNN


def make_network(shape=(1, 12, 20), **options):
    network = SmallCNN(shape, 3, **options)
    draw_weights(network)
    return network


@torch.no_grad()
def draw_weights(network):
    for parameter in network.parameters():
        parameter.copy_(halves(*parameter.shape))


def halves(*shape):
    return torch.randint(-1, 2, shape) / 2


def forward_backward(network, by, images, weights):
    """Return logits of `by`, and the gradients of the network after a backward pass."""
    network.zero_grad()
    logits = by(images)
    (logits * weights).sum().backward()
    return logits.detach(), [p.grad.clone() for p in network.parameters()]
