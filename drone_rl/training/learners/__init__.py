"""Ways to learn from a batch."""

from drone_rl.training.learners.actor_critic_learner import ActorCriticLearner as ActorCriticLearner
from drone_rl.training.learners.learner import Learner as Learner
from drone_rl.training.learners.learner import NotANumberError as NotANumberError
from drone_rl.training.learners.learner import check_batch as check_batch
from drone_rl.training.learners.learner import check_finite as check_finite
from drone_rl.training.learners.reinforce_learner import ReinforceLearner as ReinforceLearner
