"""Small things to fly: networks that do one thing, in a short task."""

import torch

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.envs import GrayPixels
from drone_rl.policies import ImageNetwork
from drone_rl.trust.paired_evaluation import EvaluatedPolicy

TASK = TaskSettings(num_cubes=1, first_distance=8.0, front_margin=4.0)


class Steering(ImageNetwork):
    """Turns to where the picture is darkest in its middle row, left of the middle or right."""

    in_shape = (1, 5, 16)

    def forward(self, pixels):
        row = pixels[..., 0, 1, :]
        left, right = row[..., :7].amin(-1), row[..., 9:].amin(-1)
        middle = row[..., 7:9].amin(-1)
        return -torch.stack([middle - 0.01, left, right], -1)


class Blind(ImageNetwork):
    """Does the same whatever it sees."""

    in_shape = (1, 5, 16)

    def __init__(self, action=0):
        super().__init__()
        self.action = action

    def forward(self, pixels):
        logits = torch.zeros(*pixels.shape[:-3], 3)
        logits[..., self.action] = 1.0
        return logits


SMALL = CameraSettings(width=16, height=5)


def subject(network=None, task=TASK, transforms=None, camera=SMALL):
    return EvaluatedPolicy(
        network or Steering(),
        task,
        camera,
        {"pixels": [GrayPixels()] if transforms is None else transforms},
    )
