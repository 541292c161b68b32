"""Returns, their estimators, and the loss that learns from them."""

from drone_rl.objectives.advantages import Advantages as Advantages
from drone_rl.objectives.original_returns import LinearRamp as LinearRamp
from drone_rl.objectives.original_returns import Standardized as Standardized
from drone_rl.objectives.original_returns import SuccessScaled as SuccessScaled
from drone_rl.objectives.original_returns import TimeBaseline as TimeBaseline
from drone_rl.objectives.reinforce import ReinforceLoss as ReinforceLoss
from drone_rl.objectives.returns import BatchNormalized as BatchNormalized
from drone_rl.objectives.returns import LeaveOneOut as LeaveOneOut
from drone_rl.objectives.returns import ReturnEstimator as ReturnEstimator
from drone_rl.objectives.returns import RewardToGo as RewardToGo
from drone_rl.objectives.returns import TotalReward as TotalReward
