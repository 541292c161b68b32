"""Networks, actors and policies: from camera images to actions."""

from drone_rl.policies.actor import greedy_agent as greedy_agent
from drone_rl.policies.actor import make_actor as make_actor
from drone_rl.policies.critic import ActorCritic as ActorCritic
from drone_rl.policies.external_network import ExternalNetwork as ExternalNetwork
from drone_rl.policies.networks import MLP as MLP
from drone_rl.policies.networks import ImageNetwork as ImageNetwork
from drone_rl.policies.networks import OriginalCNN as OriginalCNN
from drone_rl.policies.networks import PolicyNetwork as PolicyNetwork
from drone_rl.policies.networks import SmallCNN as SmallCNN
from drone_rl.policies.recurrent import RecurrentNetwork as RecurrentNetwork
