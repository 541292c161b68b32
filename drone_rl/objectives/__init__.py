"""Returns, their estimators, and the loss that learns from them."""

from drone_rl.objectives.estimators import (
    Advantages,
    BatchNormalised,
    LeaveOneOut,
    LinearRamp,
    RewardToGo,
    Standardised,
    SuccessScaled,
    TimeBaseline,
    TotalReward,
)
from drone_rl.objectives.reinforce import ReinforceLoss
from drone_rl.objectives.return_estimator import ReturnEstimator

__all__ = [
    "Advantages",
    "BatchNormalised",
    "LeaveOneOut",
    "LinearRamp",
    "ReinforceLoss",
    "ReturnEstimator",
    "RewardToGo",
    "Standardised",
    "SuccessScaled",
    "TimeBaseline",
    "TotalReward",
]
