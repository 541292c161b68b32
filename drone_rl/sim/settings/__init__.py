"""What can be chosen about tasks and the camera; known without what they are made of."""

from drone_rl.sim.settings.actions import MOVES_SETTINGS, ActionSettings
from drone_rl.sim.settings.appearance import MINIMAL, AppearanceSettings
from drone_rl.sim.settings.camera import CameraSettings
from drone_rl.sim.settings.cubes import TaskSettings
from drone_rl.sim.settings.dynamics import COMPUTER_VISION, DynamicsSettings
from drone_rl.sim.settings.pillars import PillarsSettings
from drone_rl.sim.settings.registry import TASKS, named_settings, read_task, settings_of
from drone_rl.sim.settings.renderers import RENDERERS, RendererName
from drone_rl.sim.settings.sensors import SensorSettings
from drone_rl.sim.settings.task import BaseTaskSettings

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
