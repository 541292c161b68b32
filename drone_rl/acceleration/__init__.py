"""Faster implementations of collecting, learning and inference. The package is optional.

Everything else works without it, only slower, and imports it in `drone_rl.collectors.speedups`
alone, by the functions below. What they do not support they answer with the reasons.
"""

from drone_rl.acceleration.direct_collector import DirectCollector, DirectStream
from drone_rl.acceleration.fused_collector import FusedCollector
from drone_rl.acceleration.fused_network import ActivationCache, FusedNetwork
from drone_rl.acceleration.inference_kernel import BatchedInference
from drone_rl.acceleration.selection import (
    accelerate,
    accelerate_gradients,
    accelerate_inference,
    accelerate_stream,
)

__all__ = [
    "ActivationCache",
    "BatchedInference",
    "DirectCollector",
    "DirectStream",
    "FusedCollector",
    "FusedNetwork",
    "accelerate",
    "accelerate_gradients",
    "accelerate_inference",
    "accelerate_stream",
]
