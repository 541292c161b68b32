"""Axes of perturbation to which a training is exposed, by its settings."""

import dataclasses

import pytest

from benchmarks.robust_comparison import TOUCHED_BY, changed, touched_axes, untouched_kinds
from drone_rl.config import AppearanceSettings, CameraSettings, TaskSettings
from drone_rl.config.training import TrainSettings
from drone_rl.config.transforms import Blur, Fault, Gray, LateFrames, Noise, Shift, Standardize
from drone_rl.trust.axes import AXES, GROUPS
from drone_rl.utils.settings import snake_case


def seeing(*steps):
    return TrainSettings(transforms=(Gray(), *steps, Standardize()))


def test_the_default_training_is_exposed_to_no_axis():
    assert changed(TrainSettings()) == set()
    assert touched_axes(TrainSettings()) == []
    assert untouched_kinds(TrainSettings()) == [*GROUPS]


def test_settings_of_learning_do_not_matter():
    settings = TrainSettings(seed=3, evaluate_after=10)
    assert changed(settings) == set()


@pytest.mark.parametrize(
    ("settings", "axes"),
    [
        (TrainSettings(appearance=AppearanceSettings(exposure=(0.5, 2.0))), ["brightness"]),
        (TrainSettings(appearance=AppearanceSettings(shadows=0.5)), ["sun"]),
        (TrainSettings(appearance=AppearanceSettings(ambient_strength=0.4)), ["sun", "brightness"]),
        (TrainSettings(task=TaskSettings(cube_size=2.0)), ["object_size"]),
        (TrainSettings(camera=CameraSettings(horizontal_fov=120.0)), ["field_of_view"]),
        (seeing(Shift()), ["camera_yaw", "camera_pitch"]),
        (
            TrainSettings(appearance=AppearanceSettings(camera_turn=(0.0, 3.0, 0.0))),
            ["camera_yaw", "camera_pitch", "camera_roll"],
        ),
        (TrainSettings(appearance=AppearanceSettings(distractors=(0, 8))), ["distractors"]),
        (seeing(Noise()), ["noise", "slow_noise"]),
        (seeing(LateFrames(), Blur()), ["blur", "late_frames", "action_delay"]),
    ],
)
def test_axes_of_a_training(settings, axes):
    assert touched_axes(settings) == axes
    kinds = {AXES[name].group for name in axes}
    assert untouched_kinds(settings) == [kind for kind in GROUPS if kind not in kinds]


def test_every_setting_of_appearance_and_every_fault_belongs_to_an_axis():
    named = {name for names in TOUCHED_BY.values() for name in names}
    appearance = {f"appearance.{field.name}" for field in dataclasses.fields(AppearanceSettings)}
    faults = {f"transforms.{snake_case(fault)}" for fault in (Blur, *Fault.variants())}
    assert appearance | faults <= named


def test_settings_that_axes_name_exist():
    known = {f"appearance.{f.name}" for f in dataclasses.fields(AppearanceSettings)}
    known |= {f"transforms.{snake_case(fault)}" for fault in (Blur, *Fault.variants())}
    known |= {f"task.{f.name}" for f in dataclasses.fields(TaskSettings)}
    known |= {"camera.horizontal_fov", "task.width", "task.pillar_color"}
    assert {name for names in TOUCHED_BY.values() for name in names} <= known
