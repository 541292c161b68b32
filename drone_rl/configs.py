"""Types of the settings: a misspelt name or a wrong type is refused when Hydra composes."""

import dataclasses

from hydra.core.config_store import ConfigStore
from omegaconf import MISSING


@dataclasses.dataclass
class TaskConfig:
    """Schema of conf/task; see `drone_rl.sim.settings.TaskSettings`."""

    _target_: str = "drone_rl.sim.settings.TaskSettings"
    num_cubes: int = MISSING
    first_distance: float = MISSING
    spacing: float = MISSING
    lateral_bound: float = MISSING
    vertical_bound: float = MISSING
    cube_size: float = MISSING
    cube_color: tuple[float, float, float] = MISSING
    drone_size: float = MISSING
    altitude: float = MISSING
    step_length: float = MISSING
    step_limit: int = MISSING
    front_margin: float = MISSING
    side_margin: float = MISSING


@dataclasses.dataclass
class CameraConfig:
    """Schema of conf/camera; see `drone_rl.sim.settings.CameraSettings`."""

    _target_: str = "drone_rl.sim.settings.CameraSettings"
    width: int = MISSING
    height: int = MISSING
    horizontal_fov: float = MISSING


@dataclasses.dataclass
class CollectorConfig:
    """Schema of conf/collector."""

    make: str = MISSING
    num_envs: int = MISSING
    num_threads: int = MISSING


@dataclasses.dataclass
class RayCollectorConfig(CollectorConfig):
    """Schema of conf/collector/ray.yaml."""

    address: str | None = MISSING
    num_cpus: float = MISSING
    max_lost_workers: int = MISSING


@dataclasses.dataclass
class TrainerConfig:
    """Schema of conf/trainer; see `drone_rl.training.Trainer`."""

    total_frames: int = MISSING
    total_episodes: int | None = MISSING
    target_share: float | None = MISSING
    running_decay: float = MISSING
    max_grad_norm: float | None = MISSING
    minibatch_frames: int = MISSING
    checkpoint_interval_s: float = MISSING


SCHEMAS = {
    "task": TaskConfig,
    "camera": CameraConfig,
    "collector": CollectorConfig,
    "trainer": TrainerConfig,
}
"""Groups whose files start from a schema, `base_<group>`."""


def register_configs() -> None:
    """Tells Hydra the schemas; called by the command line before it composes."""
    store = ConfigStore.instance()
    for group, schema in SCHEMAS.items():
        store.store(group=group, name=f"base_{group}", node=schema)
    store.store(group="collector", name="base_ray", node=RayCollectorConfig)
