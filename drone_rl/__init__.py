"""Train, evaluate and audit vision policies of a drone, with pip alone.

What is listed here is imported when it is first used, so that `import drone_rl` is quick.
"""

import importlib
from typing import TYPE_CHECKING, Any

from drone_rl.api.gymnasium import register
from drone_rl.utils.garbage import collecting_no_garbage
from drone_rl.utils.when_imported import import_quietly, when_imported

if TYPE_CHECKING:
    from drone_rl.api.bodies import Bodies, bodies
    from drone_rl.api.chances import Chances, chances
    from drone_rl.api.checking import Check, check
    from drone_rl.api.domains import Coverage
    from drone_rl.api.environment import make_env
    from drone_rl.api.evaluating import Evaluation, evaluate
    from drone_rl.api.explaining import Explanations, explain
    from drone_rl.api.exporting import export_onnx
    from drone_rl.api.foreign import ForeignPolicy, policy_from
    from drone_rl.api.judgements import Judgements
    from drone_rl.api.judging import Judgement, judge
    from drone_rl.api.mapping import Places, places
    from drone_rl.api.policy import Policy, load_policy
    from drone_rl.api.provable import train_until_proved
    from drone_rl.api.proving import Proof, load_proof, prove
    from drone_rl.api.shifting import Shifts, shifts
    from drone_rl.api.training import Training, train
    from drone_rl.envs.gymnasium.world import DroneWorld
    from drone_rl.envs.gymnasium.worlds import DroneWorlds
    from drone_rl.envs.sb3.worlds import Sb3Worlds
    from drone_rl.explanations.settings import ExplainSettings
    from drone_rl.pilot.errors import PilotError
    from drone_rl.pilot.future import FlightFuture
    from drone_rl.pilot.pilot import Pilot
    from drone_rl.pilot.sensing import Sensors
    from drone_rl.pilot.state import PilotState
    from drone_rl.pilot.sticks import Sticks
    from drone_rl.pilot.trajectory import Trajectory
    from drone_rl.pilot.turning import Drivetrain, YawMode
    from drone_rl.policies.sb3.logits import Sb3Logits
    from drone_rl.policies.sb3.trunk import Sb3Trunk
    from drone_rl.settings.bodies import BodiesSettings
    from drone_rl.settings.chances import ChanceSettings
    from drone_rl.settings.checking import CheckSettings
    from drone_rl.settings.judging import EvaluateSettings, JudgeSettings
    from drone_rl.settings.mapping import PlacesSettings
    from drone_rl.settings.provable import ProvableSettings
    from drone_rl.settings.proving import ProveSettings
    from drone_rl.settings.shifting import ShiftSettings
    from drone_rl.settings.training import TrainerSettings, TrainSettings
    from drone_rl.sim.image_types import ImageRequest, ImageType
    from drone_rl.sim.settings import (
        ActionSettings,
        CameraSettings,
        DynamicsSettings,
        PillarsSettings,
        TaskSettings,
    )
    from drone_rl.sim.settings.sensors import SensorSettings
    from drone_rl.utils.errors import InputError

__version__ = "0.1.0"

_PLACES = {
    "api.bodies": ("Bodies", "bodies"),
    "api.chances": ("Chances", "chances"),
    "api.checking": ("Check", "check"),
    "api.domains": ("Coverage",),
    "api.environment": ("make_env",),
    "api.evaluating": ("Evaluation", "evaluate"),
    "api.explaining": ("Explanations", "explain"),
    "api.exporting": ("export_onnx",),
    "api.foreign": ("ForeignPolicy", "policy_from"),
    "api.judgements": ("Judgements",),
    "api.judging": ("Judgement", "judge"),
    "api.mapping": ("Places", "places"),
    "api.policy": ("Policy", "load_policy"),
    "api.provable": ("train_until_proved",),
    "api.proving": ("Proof", "load_proof", "prove"),
    "api.shifting": ("Shifts", "shifts"),
    "api.training": ("Training", "train"),
    "envs.gymnasium.world": ("DroneWorld",),
    "envs.gymnasium.worlds": ("DroneWorlds",),
    "envs.sb3.worlds": ("Sb3Worlds",),
    "explanations.settings": ("ExplainSettings",),
    "pilot.errors": ("PilotError",),
    "pilot.future": ("FlightFuture",),
    "pilot.pilot": ("Pilot",),
    "pilot.sensing": ("Sensors",),
    "pilot.state": ("PilotState",),
    "pilot.sticks": ("Sticks",),
    "pilot.trajectory": ("Trajectory",),
    "pilot.turning": ("Drivetrain", "YawMode"),
    "policies.sb3.logits": ("Sb3Logits",),
    "policies.sb3.trunk": ("Sb3Trunk",),
    "settings.bodies": ("BodiesSettings",),
    "settings.chances": ("ChanceSettings",),
    "settings.checking": ("CheckSettings",),
    "settings.judging": ("EvaluateSettings", "JudgeSettings"),
    "settings.mapping": ("PlacesSettings",),
    "settings.provable": ("ProvableSettings",),
    "settings.proving": ("ProveSettings",),
    "settings.shifting": ("ShiftSettings",),
    "settings.training": ("TrainSettings", "TrainerSettings"),
    "sim.image_types": ("ImageRequest", "ImageType"),
    "sim.settings": (
        "ActionSettings",
        "CameraSettings",
        "DynamicsSettings",
        "PillarsSettings",
        "TaskSettings",
    ),
    "sim.settings.sensors": ("SensorSettings",),
    "utils.errors": ("InputError",),
}
_HOMES = {name: f"drone_rl.{module}" for module, names in _PLACES.items() for name in names}

__all__ = [
    "ActionSettings",
    "Bodies",
    "BodiesSettings",
    "CameraSettings",
    "ChanceSettings",
    "Chances",
    "Check",
    "CheckSettings",
    "Coverage",
    "Drivetrain",
    "DroneWorld",
    "DroneWorlds",
    "DynamicsSettings",
    "EvaluateSettings",
    "Evaluation",
    "ExplainSettings",
    "Explanations",
    "FlightFuture",
    "ForeignPolicy",
    "ImageRequest",
    "ImageType",
    "InputError",
    "JudgeSettings",
    "Judgement",
    "Judgements",
    "PillarsSettings",
    "Pilot",
    "PilotError",
    "PilotState",
    "Places",
    "PlacesSettings",
    "Policy",
    "Proof",
    "ProvableSettings",
    "ProveSettings",
    "Sb3Logits",
    "Sb3Trunk",
    "Sb3Worlds",
    "SensorSettings",
    "Sensors",
    "ShiftSettings",
    "Shifts",
    "Sticks",
    "TaskSettings",
    "TrainSettings",
    "TrainerSettings",
    "Training",
    "Trajectory",
    "YawMode",
    "bodies",
    "chances",
    "check",
    "evaluate",
    "explain",
    "export_onnx",
    "judge",
    "load_policy",
    "load_proof",
    "make_env",
    "places",
    "policy_from",
    "prove",
    "shifts",
    "train",
    "train_until_proved",
]

when_imported("gymnasium", register)
# dm_control looks for a screen; TorchRL derives classes from one that it deprecates
import_quietly("dm_control._render.glfw_renderer", "GLFWError", "DISPLAY")
import_quietly("torchrl.collectors.weight_update", "DeprecationWarning", "WeightUpdaterBase")


def __getattr__(name: str) -> Any:
    """Imports a public name when it is first asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module 'drone_rl' has no attribute {name!r}")
    from drone_rl.utils.quiet import noise_held_back

    with collecting_no_garbage(), noise_held_back():
        value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Returns all public names, imported or not."""
    return [*globals(), *__all__]
