"""Train, evaluate and audit vision policies of a drone. Installs with pip alone.

Public names are imported when they are first used, so that `import drone_rl` is fast.
"""

import functools
import importlib
from typing import TYPE_CHECKING, Any

from drone_rl.utils.gymnasium_names import register_environment

if TYPE_CHECKING:
    from drone_rl.config import ActionSettings as ActionSettings
    from drone_rl.config import CameraSettings as CameraSettings
    from drone_rl.config import DynamicsSettings as DynamicsSettings
    from drone_rl.config import PillarsSettings as PillarsSettings
    from drone_rl.config import TaskSettings as TaskSettings
    from drone_rl.config.commands import BodiesSettings as BodiesSettings
    from drone_rl.config.commands import ChanceSettings as ChanceSettings
    from drone_rl.config.commands import CheckSettings as CheckSettings
    from drone_rl.config.commands import EvaluateSettings as EvaluateSettings
    from drone_rl.config.commands import JudgeSettings as JudgeSettings
    from drone_rl.config.commands import PlacesSettings as PlacesSettings
    from drone_rl.config.commands import ProvableSettings as ProvableSettings
    from drone_rl.config.commands import ProveSettings as ProveSettings
    from drone_rl.config.commands import ShiftSettings as ShiftSettings
    from drone_rl.config.registry import register_collector as register_collector
    from drone_rl.config.registry import register_learner as register_learner
    from drone_rl.config.registry import register_network as register_network
    from drone_rl.config.registry import register_returns as register_returns
    from drone_rl.config.registry import register_transform as register_transform
    from drone_rl.config.sensors import SensorSettings as SensorSettings
    from drone_rl.config.terms import end as end
    from drone_rl.config.terms import event as event
    from drone_rl.config.terms import reward as reward
    from drone_rl.config.terms import success as success
    from drone_rl.config.training import CloningSettings as CloningSettings
    from drone_rl.config.training import TrainerSettings as TrainerSettings
    from drone_rl.config.training import TrainSettings as TrainSettings
    from drone_rl.envs.gymnasium.environments import DroneWorld as DroneWorld
    from drone_rl.envs.gymnasium.environments import DroneWorlds as DroneWorlds
    from drone_rl.envs.sb3.worlds import Sb3Worlds as Sb3Worlds
    from drone_rl.explanations.chapter_figures import ChapterFigure as ChapterFigure
    from drone_rl.explanations.chapter_figures import FigureSettings as FigureSettings
    from drone_rl.explanations.chapter_figures import reproduce as reproduce
    from drone_rl.explanations.class_model_gallery import ClassModels as ClassModels
    from drone_rl.explanations.class_model_gallery import class_models as class_models
    from drone_rl.explanations.explain import Explanations as Explanations
    from drone_rl.explanations.explain import explain as explain
    from drone_rl.explanations.settings import ClassModelsSettings as ClassModelsSettings
    from drone_rl.explanations.settings import ExplainSettings as ExplainSettings
    from drone_rl.flight.airsim.serving import RunningServer as RunningServer
    from drone_rl.flight.airsim.serving import serve as serve
    from drone_rl.flight.commands.command import FlightFuture as FlightFuture
    from drone_rl.flight.commands.command import PilotError as PilotError
    from drone_rl.flight.commands.path_following import Drivetrain as Drivetrain
    from drone_rl.flight.commands.path_following import YawMode as YawMode
    from drone_rl.flight.commands.pilot import Pilot as Pilot
    from drone_rl.flight.commands.pilot import Sticks as Sticks
    from drone_rl.flight.commands.state import PilotState as PilotState
    from drone_rl.flight.commands.state import Trajectory as Trajectory
    from drone_rl.flight.fly_page.server import FlyPage as FlyPage
    from drone_rl.flight.fly_page.server import fly as fly
    from drone_rl.flight.image_types import ImageRequest as ImageRequest
    from drone_rl.flight.image_types import ImageType as ImageType
    from drone_rl.flight.settings import FlySettings as FlySettings
    from drone_rl.flight.settings import ServeSettings as ServeSettings
    from drone_rl.policies.environment import make_env as make_env
    from drone_rl.policies.external_policy import ExternalPolicy as ExternalPolicy
    from drone_rl.policies.external_policy import policy_from as policy_from
    from drone_rl.policies.policy import Policy as Policy
    from drone_rl.policies.policy import load_policy as load_policy
    from drone_rl.policies.sb3 import Sb3Logits as Sb3Logits
    from drone_rl.policies.sb3 import Sb3Trunk as Sb3Trunk
    from drone_rl.sim.sensors import Sensors as Sensors
    from drone_rl.sim.tasks import register_task as register_task
    from drone_rl.sim.tasks.step_kernel import Mover as Mover
    from drone_rl.sim.tasks.step_kernel import Step as Step
    from drone_rl.sim.tasks.term_task import define_task as define_task
    from drone_rl.sim.tasks.torch_terms import Steps as Steps
    from drone_rl.training.demonstrations import Demonstration as Demonstration
    from drone_rl.training.demonstrations import FlightConditions as FlightConditions
    from drone_rl.training.demonstrations import add_demonstration as add_demonstration
    from drone_rl.training.demonstrations import read_demonstrations as read_demonstrations
    from drone_rl.training.demonstrations import record_oracle as record_oracle
    from drone_rl.training.run_folder import Training as Training
    from drone_rl.training.train import train as train
    from drone_rl.trust.bodies import Bodies as Bodies
    from drone_rl.trust.bodies import bodies as bodies
    from drone_rl.trust.evaluate import Evaluation as Evaluation
    from drone_rl.trust.evaluate import evaluate as evaluate
    from drone_rl.trust.judge import Judgement as Judgement
    from drone_rl.trust.judge import Judgements as Judgements
    from drone_rl.trust.judge import judge as judge
    from drone_rl.trust.onnx_export import export_onnx as export_onnx
    from drone_rl.trust.shifts import Shifts as Shifts
    from drone_rl.trust.shifts import shifts as shifts
    from drone_rl.trust.shifts_results import Coverage as Coverage
    from drone_rl.utils.errors import InputError as InputError
    from drone_rl.verification.chances import Chances as Chances
    from drone_rl.verification.chances import chances as chances
    from drone_rl.verification.check import Check as Check
    from drone_rl.verification.check import check as check
    from drone_rl.verification.places import Places as Places
    from drone_rl.verification.places import places as places
    from drone_rl.verification.provable import train_until_proved as train_until_proved
    from drone_rl.verification.prove import Proof as Proof
    from drone_rl.verification.prove import load_proof as load_proof
    from drone_rl.verification.prove import prove as prove

__version__ = "0.2.0.dev0"

# the imports above are for type checkers, and the list of public names
with open(__file__, encoding="utf-8") as _own_source:  # importing pathlib takes longer
    _FOUND = [line.split() for line in _own_source if line.startswith("    from ")]
_HOMES = {name: module for _, module, _, name, *_ in _FOUND}

__all__ = [*_HOMES]  # pyright: ignore[reportUnsupportedDunderAll] (aliases above are public)

for _task in ("collect_cubes", "pillars", "reach"):  # those of `drone_rl.sim.tasks`, imported later
    register_environment(_task)


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _HOMES:
        of_command = {"verdict": "judge", "chain": "chances"}.get(name)
        hint = f"; drone-rl {name} is drone_rl.{of_command}" if of_command else ""
        raise AttributeError(f"module 'drone_rl' has no attribute {name!r}{hint}")
    module = importlib.import_module(_HOMES[name])
    value = globals()[name] = _with_defaults(getattr(module, name), **_defaults_of(name))
    return value


def _defaults_of(name: str) -> dict[str, Any]:
    """Return the arguments by which packages work together that do not import each other."""
    if name == "train":
        from drone_rl.training.run_folder import Judge
        from drone_rl.trust.verdict import check_judged, judge_for_selection

        return {"judge": Judge(check_judged, judge_for_selection)}
    if name == "judge":
        from drone_rl.verification.claim import find_claim

        return {"find_claim": find_claim}
    if name == "bodies":
        from drone_rl.flight.sitl_evaluation import figures_in_the_loop

        return {"judge": __getattr__("judge"), "in_the_loop": figures_in_the_loop}
    if name == "explain":
        from drone_rl.verification.claim import find_claim
        from drone_rl.verification.places_section import places_section

        return {"find_claim": find_claim, "more_sections": {"places": places_section}}
    return {}


def _with_defaults(public: Any, **defaults: Any) -> Any:
    """Return the function with other defaults of some arguments, or anything without such."""
    if not defaults:
        return public

    @functools.wraps(public)
    def call(*args: Any, **kwargs: Any) -> Any:
        return public(*args, **{**defaults, **kwargs})

    return call


def __dir__() -> list[str]:
    """Return the module's names, imported or not."""
    return sorted({*globals(), *__all__})
