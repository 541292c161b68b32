"""Training: the loop, its components and callbacks, and the folder of a run."""

from drone_rl.training import actor_critic, ray_workers  # they connect parts with their settings
from drone_rl.training.callbacks import (
    Callback,
    CheckpointCallback,
    CsvCallback,
    LoggerCallback,
    Progress,
    ProgressCallback,
)
from drone_rl.training.learners import (
    ActorCriticLearner,
    Learner,
    NotANumberError,
    ReinforceLearner,
)
from drone_rl.training.trainer import Trainer
from drone_rl.utils.checkpoint import check_weights, load_checkpoint, save_checkpoint

__all__ = [
    "ActorCriticLearner",
    "Callback",
    "CheckpointCallback",
    "CsvCallback",
    "Learner",
    "LoggerCallback",
    "NotANumberError",
    "Progress",
    "ProgressCallback",
    "ReinforceLearner",
    "Trainer",
    "actor_critic",
    "check_weights",
    "load_checkpoint",
    "ray_workers",
    "save_checkpoint",
]
