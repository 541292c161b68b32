"""Images of a stage, rendered without a server."""

import torch

from drone_rl.flight.airsim.cameras import make_cameras
from drone_rl.flight.airsim.settings_file import CameraChoice, Capture
from drone_rl.flight.image_types import ImageType
from drone_rl.sim.dynamics import BodyState

SMALL = {kind: Capture(32, 18, 90.0) for kind in ImageType}


def body_at(*position):
    return BodyState.at_rest(torch.tensor([position], dtype=torch.float64))


def look(stage, camera="front_center", kind=ImageType.SCENE, position=(0.0, 0.0, 2.5), **choice):
    cameras = make_cameras(SMALL, {camera: CameraChoice(**choice)} if choice else {})
    (found,) = stage.render(body_at(*position), cameras[camera], [kind])
    return stage.image(kind, found, as_float=kind not in (ImageType.SCENE, ImageType.SEGMENTATION))
