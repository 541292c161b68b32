"""Speed of a network that takes a known time."""

import time

import pytest
from torch import nn

from benchmarks.proving import network_images_per_s


class Slow(nn.Module):
    def forward(self, images):
        assert images.shape == (1024, 1, 5, 8)
        time.sleep(0.02)


def test_images_per_second():
    assert network_images_per_s(Slow(), (1, 5, 8)) == pytest.approx(51_200, rel=0.5)
