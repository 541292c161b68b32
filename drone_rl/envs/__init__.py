"""The TorchRL environment and its image transforms; Gymnasium and SB3 versions."""

from drone_rl.envs.camera_faults import Blur as Blur
from drone_rl.envs.camera_faults import CameraFault as CameraFault
from drone_rl.envs.camera_faults import DeadRows as DeadRows
from drone_rl.envs.camera_faults import FrozenFrames as FrozenFrames
from drone_rl.envs.camera_faults import HeldFrames as HeldFrames
from drone_rl.envs.camera_faults import LateFrames as LateFrames
from drone_rl.envs.camera_faults import Noise as Noise
from drone_rl.envs.camera_faults import Shift as Shift
from drone_rl.envs.drone_env import DroneEnv as DroneEnv
from drone_rl.envs.drone_env import base_env as base_env
from drone_rl.envs.drone_env import with_others as with_others
from drone_rl.envs.drone_env import worlds_of as worlds_of
from drone_rl.envs.observer import Observer as Observer
from drone_rl.envs.observer import Pipeline as Pipeline
from drone_rl.envs.transforms import ChromaticityPixels as ChromaticityPixels
from drone_rl.envs.transforms import CropRows as CropRows
from drone_rl.envs.transforms import GrayPixels as GrayPixels
from drone_rl.envs.transforms import Resize as Resize
from drone_rl.envs.transforms import RgbPixels as RgbPixels
from drone_rl.envs.transforms import StandardizePixels as StandardizePixels
