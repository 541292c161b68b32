"""Faster implementations of collecting and learning, for small networks on a CPU.

Each `try_create` returns an implementation, or the reasons why it does not support a configuration;
TorchRL and PyTorch do what it does not support.
"""

from drone_rl.acceleration.fused_episodes import FusedEpisodes as FusedEpisodes
from drone_rl.acceleration.fused_network import ActivationRecorder as ActivationRecorder
from drone_rl.acceleration.fused_network import FusedNetwork as FusedNetwork
from drone_rl.acceleration.fused_network import with_fused_passes as with_fused_passes
from drone_rl.acceleration.fused_rollouts import FusedRollouts as FusedRollouts
from drone_rl.acceleration.packed_layers import Reasons as Reasons
