"""Data classes of the whole package: frozen, so that what was checked stays as it was."""

import dataclasses
import importlib
import inspect
import pkgutil

import pytest

import drone_rl
from drone_rl.utils.batch import Batch

MUTABLE = {
    "evaluation.metrics:Episodes",
    "evaluation.rollouts:StepLog",
    "explanations.class_models:Attempts",
    "explanations.class_models:ClassModel",
    "explanations.heat_maps:Explainer",
    "explanations.truth:Intervention",
    "explanations.report.explanation:Explanation",
    "explanations.response:OutcomeMap",
    "explanations.response:ResponseMap",
    "explanations.rollouts:RolloutDataset",
    "robustness.domain:End",
    "sweeps.figures:Layout",
    "sweeps.manifest:Sweep",
    "sweeps.rows:Row",
    "sweeps.summary:Group",
    "training.callbacks:Progress",
    "verification.provable:Journal",
    "verification.prover.lattice:Graph",
    "verification.prover.prover:Findings",
}
"""Those that are not frozen, or not yet, below drone_rl; batches of tensors are none of them."""
BY_NAME_ALONE = ("drone_rl.config.", "drone_rl.config.", "drone_rl.cli.")
"""Where fields have no order, so that adding one changes no call."""


def data_classes():
    for found in pkgutil.walk_packages(drone_rl.__path__, "drone_rl."):
        if found.name.startswith("benchmarks"):
            continue
        try:
            module = importlib.import_module(found.name)
        except ImportError:  # an optional part is not installed
            continue
        for name, kind in inspect.getmembers(module, inspect.isclass):
            is_ours = kind.__module__ == found.name and "__dataclass_params__" in vars(kind)
            if is_ours and not issubclass(kind, Batch):
                yield f"{found.name}:{name}", kind


@pytest.fixture(scope="module")
def all_of_them():
    return dict(data_classes())


def test_what_is_described_cannot_be_changed(all_of_them):
    assert len(all_of_them) > 100
    changeable = {n for n, k in all_of_them.items() if not k.__dataclass_params__.frozen}
    assert {name.removeprefix("drone_rl.") for name in changeable} == MUTABLE


def test_settings_are_given_by_name(all_of_them):
    by_place = {
        f"{name}.{field.name}"
        for name, kind in all_of_them.items()
        for field in dataclasses.fields(kind)
        if name.startswith(BY_NAME_ALONE) and field.init and not field.kw_only
        if name != "drone_rl.config.configuration:Changes"  # a type, and nothing else
    }
    assert by_place == set()
