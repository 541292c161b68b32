"""Data classes of the package are frozen, so validated values stay valid."""

import importlib
import inspect
import pkgutil
from pathlib import Path

import pytest

import drone_rl
from drone_rl.utils.batch import Batch
from tools.readme.settings import list_commands, list_groups, list_parts

MUTABLE = {
    "collectors.complete_episodes:CompleteEpisodes",
    "explanations.heat_maps:Explainer",
    "explanations.truth:Intervention",
    "explanations.rollouts:RolloutDataset",
    "policies.zoo.files:TrainingProgress",
    "sim.scenes.elements:Element",
    "sim.scenes.reader:Reading",
    "sweeps.figures:Layout",
    "training.actor_critic:ActorCriticLearner",
    "training.learners:GradientLearner",
    "training.learners:ReinforceLearner",
    "training.trainer:Trainer",
    "verification.provable:Journal",
    "verification.prover.lattice:Graph",
    "verification.prover.prover:ProofFindings",
}
"""Data classes below drone_rl that are not frozen; batches of tensors are exempt."""


def data_classes():
    for found in pkgutil.walk_packages(drone_rl.__path__, "drone_rl."):
        if found.name.startswith("benchmarks"):
            continue
        try:
            module = importlib.import_module(found.name)
        except ImportError:  # an optional dependency is not installed
            continue
        for name, kind in inspect.getmembers(module, inspect.isclass):
            is_ours = kind.__module__ == found.name and "__dataclass_params__" in vars(kind)
            if is_ours and not issubclass(kind, Batch):
                yield f"{found.name}:{name}", kind


@pytest.fixture(scope="module")
def classes():
    return dict(data_classes())


def test_data_classes_are_frozen(classes):
    assert len(classes) > 50
    mutable = {n for n, k in classes.items() if not k.__dataclass_params__.frozen}
    assert {name.removeprefix("drone_rl.") for name in mutable} == MUTABLE


@pytest.mark.parametrize("make", [list_groups, list_parts, list_commands])
def test_bounds_units_and_defaults_of_settings_are_the_documented_ones(make):
    page = (Path(drone_rl.__file__).parents[1] / "docs" / "settings.md").read_text()
    assert make() in page
