"""Networks and actors; they see specs, never a simulator."""

from drone_rl.policies.actor import make_actor
from drone_rl.policies.critic import ActorCritic
from drone_rl.policies.external_network import ForeignNetwork
from drone_rl.policies.networks import MLP, OriginalCNN, PictureNetwork, PolicyNetwork, SmallCNN

__all__ = [
    "MLP",
    "ActorCritic",
    "ForeignNetwork",
    "OriginalCNN",
    "PictureNetwork",
    "PolicyNetwork",
    "SmallCNN",
    "make_actor",
]
