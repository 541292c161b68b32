"""Settings of tasks, cameras, appearance, dynamics and sensors; imports nothing heavy."""

from drone_rl.config.appearance import MINIMAL as MINIMAL
from drone_rl.config.appearance import AppearanceSettings as AppearanceSettings
from drone_rl.config.camera import RENDERERS as RENDERERS
from drone_rl.config.camera import CameraSettings as CameraSettings
from drone_rl.config.camera import RendererName as RendererName
from drone_rl.config.dynamics import COMPUTER_VISION as COMPUTER_VISION
from drone_rl.config.dynamics import MOVES_SETTINGS as MOVES_SETTINGS
from drone_rl.config.dynamics import ActionSettings as ActionSettings
from drone_rl.config.dynamics import DynamicsSettings as DynamicsSettings
from drone_rl.config.reach import ReachSettings as ReachSettings
from drone_rl.config.sensors import SensorSettings as SensorSettings
from drone_rl.config.task import TASKS as TASKS
from drone_rl.config.task import BaseTaskSettings as BaseTaskSettings
from drone_rl.config.task import PillarsSettings as PillarsSettings
from drone_rl.config.task import TaskSettings as TaskSettings
