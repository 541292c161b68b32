"""The worlds as TorchRL environments, and the pixel pipeline behind them."""

from drone_rl.envs.camera_fault import CameraFault
from drone_rl.envs.drone_env import DroneEnv, worlds_of
from drone_rl.envs.fault_transforms import Blur, DeadRows, FrozenFrames, LateFrames, Noise, Shift
from drone_rl.envs.pipeline import on_pixels, with_transforms
from drone_rl.envs.transforms import (
    ChromaticityPixels,
    CropRows,
    GrayPixels,
    Resize,
    RgbPixels,
    StandardizePixels,
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
