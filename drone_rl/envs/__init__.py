"""The TorchRL environment and its image transforms; Gymnasium and SB3 versions."""

from drone_rl.envs.camera_faults import (
    Blur,
    CameraFault,
    DeadRows,
    FrozenFrames,
    LateFrames,
    Noise,
    Shift,
)
from drone_rl.envs.drone_env import DroneEnv, worlds_of
from drone_rl.envs.transforms import (
    ChromaticityPixels,
    CropRows,
    GrayPixels,
    Resize,
    RgbPixels,
    StandardizePixels,
    on_pixels,
    with_transforms,
)

__all__ = [
    "Blur",
    "CameraFault",
    "ChromaticityPixels",
    "CropRows",
    "DeadRows",
    "DroneEnv",
    "FrozenFrames",
    "GrayPixels",
    "LateFrames",
    "Noise",
    "Resize",
    "RgbPixels",
    "Shift",
    "StandardizePixels",
    "on_pixels",
    "with_transforms",
    "worlds_of",
]
