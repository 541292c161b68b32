"""`drone-rl play`."""

import dataclasses
from pathlib import Path
from typing import Annotated

import drone_rl
from drone_rl.cli.hydra.resuming import policies as prepare  # noqa: F401 -- of what was typed
from drone_rl.config import AppearanceSettings, RendererName
from drone_rl.config.commands import PathsSettings
from drone_rl.config.configuration import DynamicsChanges, TaskChanges, no_changes
from drone_rl.utils.schema import Whole
from drone_rl.utils.settings import Settings


@dataclasses.dataclass(frozen=True, kw_only=True)
class Command(Settings):
    """What `drone-rl play` can be told."""

    policy: str = "latest"
    """Who flies, see `drone_rl.load_policy`."""
    episodes: Annotated[int, Whole(1, unit="episodes")] = 3
    """Episodes to film, one file each."""
    greedy: bool = True
    """Whether to take the most probable action instead of drawing one."""
    seed: Annotated[int, Whole(0)] = 0
    """Root of the worlds' random streams."""
    viewer: bool = False
    """Whether to open dm_control's viewer, which needs a display, instead of filming."""
    device: str = "cpu"
    """Where worlds are drawn and the policy runs: cpu, cuda or cuda:N."""
    renderer: RendererName = "raytrace"
    """Who draws: raytrace, our own, or mujoco_warp, MuJoCo Warp's."""
    appearance: AppearanceSettings | None = None
    """How worlds look; none for as in the policy's training."""
    task: TaskChanges = no_changes()
    """What to change of the policy's task."""
    dynamics: DynamicsChanges = no_changes()
    """What to change of how the policy's drone moves."""
    paths: PathsSettings = PathsSettings()
    """Folders."""


def run(settings: Command, folder: Path) -> tuple[int, None]:
    """Films a policy. Returns the exit status."""
    policy = drone_rl.load_policy(settings.policy, outputs=settings.paths.outputs)
    from drone_rl.evaluation.video import film, view  # after what is slow to import

    policy = policy.in_task(**settings.task)
    policy = policy.in_dynamics(**settings.dynamics) if settings.dynamics else policy
    names = ("greedy", "seed", "device", "renderer", "appearance")
    chosen = {name: getattr(settings, name) for name in names}
    if settings.viewer:
        view(policy, **chosen)
    else:
        film(policy, folder, settings.episodes, **chosen)
    return 0, None
