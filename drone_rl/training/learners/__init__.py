"""Ways to learn from a batch."""

from drone_rl.training.learners.actor_critic_learner import ActorCriticLearner
from drone_rl.training.learners.learner import Learner, NotANumberError, check_batch, check_finite
from drone_rl.training.learners.reinforce_learner import ReinforceLearner

__all__ = [
    "ActorCriticLearner",
    "Learner",
    "NotANumberError",
    "ReinforceLearner",
    "check_batch",
    "check_finite",
]
