"""Fields of settings as keyword arguments, for type checkers and completion.

Functions such as `drone_rl.train(**changes)` take them; `from_arguments` checks names and values.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypedDict

from typing_extensions import TypedDict as OpenTypedDict

from drone_rl.config.appearance import AppearanceSettings
from drone_rl.config.camera import CameraSettings
from drone_rl.config.dynamics import ActionSettings, DynamicsSettings
from drone_rl.config.learning import Collector, Objective, Optimizer, Returns, Scheduler
from drone_rl.config.networks import Network
from drone_rl.config.task import BaseTaskSettings
from drone_rl.config.training import CloningSettings, TrainerSettings
from drone_rl.config.transforms import Transform


class RendererOptions(TypedDict, total=False):
    """Fields of `RendererSettings`."""

    renderer: str


class DeviceOptions(RendererOptions, total=False):
    """Fields of `DeviceSettings`."""

    device: str


class GymnasiumOptions(DeviceOptions, total=False):
    """Fields of `GymnasiumSettings`; settings of the task are given in the same way."""

    observations: str
    camera: CameraSettings | Mapping[str, Any]
    transforms: Sequence[Transform] | Mapping[str, Any]
    dynamics: DynamicsSettings | Mapping[str, Any]
    actions: ActionSettings | Mapping[str, Any]
    render_mode: str | None


class HeldOutOptions(DeviceOptions, total=False):
    """Fields of `HeldOutSettings`."""

    episodes: int
    seed: int | None
    num_envs: int


class EvaluateOptions(HeldOutOptions, total=False):
    """Fields of `EvaluateSettings`."""

    baselines: bool


class JudgeOptions(HeldOutOptions, total=False):
    """Fields of `JudgeSettings`."""

    sampled: bool
    good_share: float
    certificate_flights: int
    domain_flights: int


class BodiesOptions(JudgeOptions, total=False):
    """Fields of `BodiesSettings` except the policies."""

    bodies: Sequence[str]
    loop_flights: int


class ShiftOptions(DeviceOptions, total=False):
    """Fields of `ShiftSettings`."""

    axes: Any
    strengths: Sequence[int]
    modes: Sequence[str]
    domain: bool
    episodes: int
    domain_episodes: int
    seed: int | None
    good_share: float
    possible_share: float


class ChanceOptions(DeviceOptions, total=False):
    """Fields of `ChanceSettings`."""

    placements: int
    seed: int | None
    within: float
    parts: int


class CheckOptions(DeviceOptions, total=False):
    """Fields of `CheckSettings`."""

    flights: int
    seed: int | None


class PlacesOptions(RendererOptions, total=False):
    """Fields of `PlacesSettings`."""

    nearest: float
    farthest: float
    sideways: float
    logit_gap: float
    compared: int
    most_cells: int


class ProveOptions(RendererOptions, total=False):
    """Fields of `ProveSettings`."""

    logit_gap: float
    compared: int
    limit_s: float | None
    save_interval_s: float
    most_boxes: int
    most_combinations: int


class FlyOptions(RendererOptions, total=False):
    """Fields of `FlySettings`."""

    view: str
    mode: str
    greedy: bool
    saliency: bool
    seed: int
    port: int
    frames_per_second: int
    demonstrations: str | None


class ServeOptions(TypedDict, total=False):
    """Fields of `ServeSettings`."""

    scene: str | Path
    clock: str
    date: str
    patience_s: float
    address: str | None
    port: int | None
    seed: int
    raw_channels: int
    renderer: str | None


class VehicleOptions(TypedDict, total=False):
    """Fields of `DynamicsSettings` except its mode."""

    camera_mount: str
    control_ticks: int
    tick: float
    wind: Sequence[float]
    gusts: float
    gust_length: float
    air_density: float
    mass: float
    inertia: Sequence[float]
    arm_length: float
    radius: float
    rotor_thrust: float
    rotor_torque: float
    rotor_time_constant: float
    drag_area: Sequence[float]
    restitution: float
    friction: float
    rate_gain: Sequence[float]
    rate_limit: Sequence[float]
    angle_gain: Sequence[float]
    angle_limit: float
    velocity_gain: float
    velocity_limit: float
    climb_gain: float
    climb_integral: float
    climb_limit: float
    position_gain: float


class DynamicsOptions(VehicleOptions, total=False):
    """Fields of `DynamicsSettings`."""

    mode: str


class TaskOptions(OpenTypedDict, total=False, extra_items=Any):
    """Fields of `TaskSettings` and `PillarsSettings`; a task of one's own may have others."""

    num_cubes: int
    num_rows: int
    first_distance: float
    spacing: float
    lateral_bound: float
    vertical_bound: float
    cube_size: float
    cube_color: Sequence[float]
    drone_size: float
    altitude: float
    step_length: float
    step_limit: int
    front_margin: float
    side_margin: float
    density: float
    width: float
    spread: float
    height: float
    pillar_color: Sequence[float]
    finish_margin: float
    collision_penalty: float


class UnseededTrainOptions(TypedDict, total=False):
    """Fields of `TrainSettings` except the seed."""

    task: BaseTaskSettings | str | Mapping[str, Any]
    appearance: AppearanceSettings | str | Mapping[str, Any]
    dynamics: DynamicsSettings | Mapping[str, Any]
    actions: ActionSettings | Mapping[str, Any]
    camera: CameraSettings | Mapping[str, Any]
    transforms: Sequence[Transform]
    network: Network | str | Mapping[str, Any]
    returns: Returns | str | Mapping[str, Any]
    objective: Objective | str | Mapping[str, Any]
    optimizer: Optimizer | str | Mapping[str, Any]
    scheduler: Scheduler | str | Mapping[str, Any]
    collector: Collector | str | Mapping[str, Any]
    trainer: TrainerSettings | Mapping[str, Any]
    demonstrations: str | None
    cloning: CloningSettings | Mapping[str, Any]
    device: str
    renderer: str
    evaluate_after: int


class TrainOptions(UnseededTrainOptions, total=False):
    """Fields of `TrainSettings`."""

    seed: int
