"""Returns, their estimators, and the loss that learns from them."""

from drone_rl.objectives.estimators import Advantages as Advantages
from drone_rl.objectives.estimators import BatchNormalized as BatchNormalized
from drone_rl.objectives.estimators import LeaveOneOut as LeaveOneOut
from drone_rl.objectives.estimators import LinearRamp as LinearRamp
from drone_rl.objectives.estimators import ReturnEstimator as ReturnEstimator
from drone_rl.objectives.estimators import RewardToGo as RewardToGo
from drone_rl.objectives.estimators import Standardized as Standardized
from drone_rl.objectives.estimators import SuccessScaled as SuccessScaled
from drone_rl.objectives.estimators import TimeBaseline as TimeBaseline
from drone_rl.objectives.estimators import TotalReward as TotalReward
from drone_rl.objectives.reinforce import ReinforceLoss as ReinforceLoss
