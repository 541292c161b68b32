"""Faster implementations of collecting and learning.

`drone_rl.collectors.speedups` is the one module that imports it. Each `try_create` returns an
implementation, or the reasons why there is none.
"""

from drone_rl.acceleration.fused_episodes import FusedEpisodes as FusedEpisodes
from drone_rl.acceleration.fused_network import ActivationRecorder as ActivationRecorder
from drone_rl.acceleration.fused_network import FusedNetwork as FusedNetwork
from drone_rl.acceleration.packed_layers import Reasons as Reasons
