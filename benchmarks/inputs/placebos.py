"""Placebo vectors: inputs of nothing but random numbers, on which actions of policies depend."""

from typing import Any

import numpy as np
import torch

from drone_rl.config.camera import CameraSettings
from drone_rl.config.inputs import (
    Altitude,
    GrayImage,
    ImageInput,
    VectorInput,
    describe_inputs,
)
from drone_rl.envs import DroneEnv
from drone_rl.explanations import importance
from drone_rl.explanations.context import Context
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.policies import SmallCNN
from drone_rl.policies.networks import InputsNetwork
from drone_rl.sim.actions import MOVES

VECTORS = 13
"""Placebos of a policy."""
_NOISE = 5.0
"""Of the altitude, which is constant; it is divided by as much."""
_GAIN = 300.0
"""Factor of the initial logits, which are near zero."""
_VECTOR_GAIN = 10.0
"""Factor of the weights of vectors, so that the placebos change many actions."""


def measure_placebos(num_policies: int = 8, frames: int = 300) -> dict[str, Any]:
    """Count placebo vectors that are called important in policies with random weights.

    Returns:
        "placebo_vectors", those that are, of "placebo_vectors_tried", whose replacement changes
        the action probabilities by "placebo_vectors_effect" (median); and of the images that they
        accompany, "placebo_images_important", the fraction that is called important.
    """
    placebos = {f"placebo_{i}": Altitude(noise=_NOISE) for i in range(VECTORS)}
    settings = {"gray": GrayImage(), **placebos}
    inputs = describe_inputs(settings, CameraSettings(), ())
    found = [_importance(inputs, seed, frames) for seed in range(num_policies)]
    vectors = [one.inputs[name] for one in found for name in placebos]
    return {
        "placebo_vectors": sum(one.matters for one in vectors),
        "placebo_vectors_tried": len(vectors),
        "placebo_vectors_effect": float(np.median([one.effect.median for one in vectors])),
        "placebo_images_important": float(np.mean([one.inputs["gray"].matters for one in found])),
    }


def _importance(
    inputs: dict[str, ImageInput | VectorInput], seed: int, frames: int
) -> importance.Importance:
    """Return the importance of the inputs of a policy with random weights."""
    generator = torch.Generator().manual_seed(seed)
    env = DroneEnv(32, inputs=inputs, seed=seed)
    shapes = {name: one.shape[1:] for name, one in env.observer.examples().items()}
    images = {"gray": SmallCNN(shapes["gray"], len(MOVES), generator=generator)}
    network = InputsNetwork(shapes, images, len(MOVES), hidden=(32,), generator=generator)
    logits = network.layers.get_parameter("logits.weight")
    with torch.no_grad():
        logits.sub_(logits.mean(1, keepdim=True)).mul_(_GAIN)
        network.branches.get_parameter("vectors.0.weight").mul_(_VECTOR_GAIN)
    found = importance.section(Context(env, network, ExplainSettings(frames=frames, seed=seed)))
    env.close()
    assert found is not None
    return found
