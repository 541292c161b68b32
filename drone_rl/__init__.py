"""Train, evaluate and audit vision policies of a drone, with pip alone.

Public names are imported when they are first used, so that `import drone_rl` is fast.
"""

import importlib
from typing import TYPE_CHECKING, Any

from drone_rl.utils.imports import import_quietly, register, when_imported
from drone_rl.utils.memory import collecting_no_garbage

if TYPE_CHECKING:
    from drone_rl.config import (
        ActionSettings,
        CameraSettings,
        DynamicsSettings,
        PillarsSettings,
        TaskSettings,
    )
    from drone_rl.config.commands import (
        BodiesSettings,
        EvaluateSettings,
        JudgeSettings,
        ShiftSettings,
    )
    from drone_rl.config.registry import (
        register_collector,
        register_learner,
        register_network,
        register_returns,
        register_transform,
    )
    from drone_rl.config.sensors import SensorSettings
    from drone_rl.config.training import TrainerSettings, TrainSettings
    from drone_rl.config.verification import (
        ChanceSettings,
        CheckSettings,
        PlacesSettings,
        ProvableSettings,
        ProveSettings,
    )
    from drone_rl.envs.gymnasium.environments import DroneWorld, DroneWorlds
    from drone_rl.envs.sb3.worlds import Sb3Worlds
    from drone_rl.evaluation.evaluate import Evaluation, evaluate
    from drone_rl.explanations.explain import Explanations, explain
    from drone_rl.explanations.settings import ExplainSettings
    from drone_rl.flight.commands.command import FlightFuture, PilotError
    from drone_rl.flight.commands.pilot import Pilot, Sticks
    from drone_rl.flight.commands.state import PilotState, Sensors, Trajectory
    from drone_rl.flight.commands.yaw import Drivetrain, YawMode
    from drone_rl.policies.environment import make_env
    from drone_rl.policies.external_policy import ForeignPolicy, policy_from
    from drone_rl.policies.policy import Policy, load_policy
    from drone_rl.policies.sb3 import Sb3Logits, Sb3Trunk
    from drone_rl.robustness.shifts import Shifts, shifts
    from drone_rl.sim.image_types import ImageRequest, ImageType
    from drone_rl.sim.tasks import register_task
    from drone_rl.training.run_folder import Training
    from drone_rl.training.train import train
    from drone_rl.utils.errors import InputError
    from drone_rl.verdicts.coverage import Coverage
    from drone_rl.verdicts.dynamics_sweep import Bodies, bodies
    from drone_rl.verdicts.judge import Judgement, Judgements, judge
    from drone_rl.verdicts.onnx_export import export_onnx
    from drone_rl.verification.chances import Chances, chances
    from drone_rl.verification.check import Check, check
    from drone_rl.verification.places import Places, places
    from drone_rl.verification.provable import train_until_proved
    from drone_rl.verification.prove import Proof, load_proof, prove

__version__ = "0.1.0"

_PLACES = {
    "verdicts.dynamics_sweep": ("Bodies", "bodies"),
    "verification.chances": ("Chances", "chances"),
    "verification.check": ("Check", "check"),
    "verdicts.coverage": ("Coverage",),
    "policies.environment": ("make_env",),
    "evaluation.evaluate": ("Evaluation", "evaluate"),
    "explanations.explain": ("Explanations", "explain"),
    "verdicts.onnx_export": ("export_onnx",),
    "policies.external_policy": ("ForeignPolicy", "policy_from"),
    "verdicts.judge": ("Judgement", "Judgements", "judge"),
    "verification.places": ("Places", "places"),
    "policies.policy": ("Policy", "load_policy"),
    "verification.provable": ("train_until_proved",),
    "verification.prove": ("Proof", "load_proof", "prove"),
    "robustness.shifts": ("Shifts", "shifts"),
    "training.run_folder": ("Training",),
    "training.train": ("train",),
    "envs.gymnasium.environments": ("DroneWorld", "DroneWorlds"),
    "envs.sb3.worlds": ("Sb3Worlds",),
    "explanations.settings": ("ExplainSettings",),
    "flight.commands.command": ("FlightFuture", "PilotError"),
    "flight.commands.pilot": ("Pilot", "Sticks"),
    "flight.commands.state": ("PilotState", "Sensors", "Trajectory"),
    "flight.commands.yaw": ("Drivetrain", "YawMode"),
    "policies.sb3": ("Sb3Logits", "Sb3Trunk"),
    "config.commands": ("BodiesSettings", "EvaluateSettings", "JudgeSettings", "ShiftSettings"),
    "config.verification": (
        "ChanceSettings",
        "CheckSettings",
        "PlacesSettings",
        "ProvableSettings",
        "ProveSettings",
    ),
    "config.registry": (
        "register_collector",
        "register_learner",
        "register_network",
        "register_returns",
        "register_transform",
    ),
    "sim.tasks": ("register_task",),
    "config.training": ("TrainSettings", "TrainerSettings"),
    "sim.image_types": ("ImageRequest", "ImageType"),
    "config": (
        "ActionSettings",
        "CameraSettings",
        "DynamicsSettings",
        "PillarsSettings",
        "TaskSettings",
    ),
    "config.sensors": ("SensorSettings",),
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
    "register_collector",
    "register_learner",
    "register_network",
    "register_returns",
    "register_task",
    "register_transform",
    "shifts",
    "train",
    "train_until_proved",
]

when_imported("gymnasium", register)
# dm_control searches for a display; TorchRL derives classes from one that it deprecates
import_quietly("dm_control._render.glfw_renderer", "GLFWError", "DISPLAY")
import_quietly("torchrl.collectors.weight_update", "DeprecationWarning", "WeightUpdaterBase")


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _HOMES:
        raise AttributeError(f"module 'drone_rl' has no attribute {name!r}")
    with collecting_no_garbage():
        value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return all public names, imported or not."""
    return [*globals(), *__all__]
