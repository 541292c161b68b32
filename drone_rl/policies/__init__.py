"""Networks and actors; they see specs, never a simulator."""

from drone_rl.policies.actor import make_actor
from drone_rl.policies.cnn import OriginalCNN, PolicyNetwork, SmallCNN
from drone_rl.policies.critic import ActorCritic
from drone_rl.policies.mlp import MLP

__all__ = ["MLP", "ActorCritic", "OriginalCNN", "PolicyNetwork", "SmallCNN", "make_actor"]
