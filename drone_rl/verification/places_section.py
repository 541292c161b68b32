"""Section "places" of explanations: the exact map of the action over one cube's place."""

import numpy as np

from drone_rl.config import TaskSettings
from drone_rl.config.commands import PlacesSettings
from drone_rl.explanations.context import Context
from drone_rl.explanations.results import ExactMap, NoMap
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


def places_section(context: Context) -> ExactMap | NoMap:
    """Return the map, or why none is known."""
    settings = PlacesSettings()
    try:
        return _exact_map(context, settings).summary(settings.logit_gap)
    except InputError as error:
        return NoMap(refused=str(error))


def _exact_map(context: Context, settings: PlacesSettings) -> ActionMap:
    """Compute the exact map; raise InputError with the reason if the policy has none."""
    scenes, network = context.scenes, context.network
    if not isinstance(scenes.task, CollectCubes):
        raise InputError("its task is not cube collection")
    if scenes.actions != MOVES:
        raise InputError(f"it does not choose among {', '.join(MOVES.names)}")
    if scenes.memory:
        raise InputError("it observes a stack of frames, so its actions depend on earlier frames")
    task: TaskSettings = scenes.task.settings
    check_task(task)
    if not network.has_weights:
        raise InputError("it is not a torch module, so its rounding error has no bound")
    if scenes.is_ambiguous:
        raise InputError(
            "its camera has faults or its appearance has ranges, so one place has several images"
        )
    camera = CameraModel.of(task, scenes.worlds.camera)
    images = CubeImages(scenes.worlds, Lattice(task), camera)
    images.check(_COMPARED, np.random.RandomState(legacy_seed(context.seed.value)))
    nearest = max(settings.nearest, task.cube_size)
    return map_policy(images, scenes.transform, network, settings.replace(nearest=nearest))
