"""Section "places" of explanations: the exact map of the action over one cube's place."""

from typing import Any

import numpy as np

from drone_rl.config.commands import PlacesSettings
from drone_rl.config.inputs import PIXELS
from drone_rl.explanations.context import Context, LeftOutError, needs
from drone_rl.explanations.results import ExactMap
from drone_rl.sim.actions import MOVES
from drone_rl.sim.tasks import CollectCubes
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import legacy_seed
from drone_rl.verification.prover.action_map import ActionMap, map_policy
from drone_rl.verification.prover.cube_images import CameraModel, CubeImages
from drone_rl.verification.prover.lattice import Lattice
from drone_rl.verification.prover.policy_spec import check_task

_COMPARED = 1000
"""Rendered frames that are compared with the closed form; fewer than in `drone-rl places`."""


def one_image_a_place(context: Context) -> str | None:
    """Need cube collection by moves, and one known image of each place."""
    scenes, network = context.scenes, context.network
    if not isinstance(scenes.task, CollectCubes):
        return "Only cube collection has an exact map."
    if scenes.actions != MOVES:
        return f"An exact map is one of a policy that chooses among {', '.join(MOVES.names)}."
    if scenes.seen != PIXELS:
        return f"An exact map is one of a policy that sees {PIXELS} alone, not {scenes.seen}."
    if scenes.memory:
        return "The policy observes a stack of frames, so its actions depend on earlier frames."
    try:
        check_task(scenes.task.settings)
    except InputError as error:
        return f"{error}."
    if not network.has_weights:
        return "The policy is not a torch module, so its rounding error has no bound."
    if scenes.is_ambiguous:
        return (
            "The camera has faults or the appearance has ranges, so one place has several images."
        )
    return None


@needs(one_image_a_place)
def places_section(context: Context) -> ExactMap:
    """Return the map."""
    settings = PlacesSettings()
    try:
        return _exact_map(context, settings).summary(settings.logit_gap)
    except InputError as error:
        raise LeftOutError(f"{error}.") from error


def _exact_map(context: Context, settings: PlacesSettings) -> ActionMap:
    """Compute the exact map; raise InputError with the reason if the policy has none."""
    scenes: Any = context.scenes
    task = scenes.task.settings
    images = CubeImages(scenes.worlds, Lattice(task), CameraModel.of(task, scenes.worlds.camera))
    images.check(_COMPARED, np.random.RandomState(legacy_seed(context.seed.value)))
    settings = settings.replace(nearest=max(settings.nearest, task.cube_size))
    return map_policy(images, scenes.transform, context.network, settings)
