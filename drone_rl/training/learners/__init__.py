"""Ways to learn from a batch; REINFORCE is one."""

from drone_rl.training.learners.learner import Learner, NotANumberError, check_batch, check_finite
from drone_rl.training.learners.reinforce_learner import ReinforceLearner

__all__ = ["Learner", "NotANumberError", "ReinforceLearner", "check_batch", "check_finite"]
