"""Training: the loop, its components and callbacks, and the folder of a run."""

from drone_rl.training import actor_critic as actor_critic  # connects parts with their settings
from drone_rl.training import ray_workers as ray_workers
from drone_rl.training.actor_critic import ActorCriticLearner as ActorCriticLearner
from drone_rl.training.callbacks import Callback as Callback
from drone_rl.training.callbacks import CheckpointCallback as CheckpointCallback
from drone_rl.training.callbacks import CsvCallback as CsvCallback
from drone_rl.training.callbacks import LoggerCallback as LoggerCallback
from drone_rl.training.callbacks import TrainingProgress as TrainingProgress
from drone_rl.training.learners import Learner as Learner
from drone_rl.training.learners import NotANumberError as NotANumberError
from drone_rl.training.learners import ReinforceLearner as ReinforceLearner
from drone_rl.training.trainer import Trainer as Trainer
from drone_rl.utils.checkpoint import load_checkpoint as load_checkpoint
from drone_rl.utils.checkpoint import save_checkpoint as save_checkpoint
