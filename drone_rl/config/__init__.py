"""Settings of tasks, cameras, appearance, dynamics and sensors; imports nothing heavy."""

from drone_rl.config.appearance import MINIMAL, AppearanceSettings
from drone_rl.config.camera import RENDERERS, CameraSettings, RendererName
from drone_rl.config.cubes import TaskSettings
from drone_rl.config.dynamics import (
    COMPUTER_VISION,
    MOVES_SETTINGS,
    ActionSettings,
    DynamicsSettings,
)
from drone_rl.config.pillars import PillarsSettings
from drone_rl.config.sensors import SensorSettings
from drone_rl.config.task import (
    TASKS,
    BaseTaskSettings,
    named_settings,
    read_task,
    settings_of,
)

__all__ = [
    "COMPUTER_VISION",
    "MINIMAL",
    "MOVES_SETTINGS",
    "RENDERERS",
    "TASKS",
    "ActionSettings",
    "AppearanceSettings",
    "BaseTaskSettings",
    "CameraSettings",
    "DynamicsSettings",
    "PillarsSettings",
    "RendererName",
    "SensorSettings",
    "TaskSettings",
    "named_settings",
    "read_task",
    "settings_of",
]
