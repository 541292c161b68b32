"""`drone-rl play`."""

from pathlib import Path
from typing import Annotated

import drone_rl
from drone_rl.cli.settings import RolloutCommandSettings
from drone_rl.config import AppearanceSettings, RendererName
from drone_rl.utils.schema import Whole


class Command(RolloutCommandSettings):
    """Settings of `drone-rl play`."""

    episodes: Annotated[int, Whole(1, unit="episodes")] = 3
    """Episodes to record, one file each."""
    greedy: bool = True
    """Whether to take the most probable action instead of sampling."""
    seed: Annotated[int, Whole(0)] = 0
    """Root of the environments' random streams."""
    viewer: bool = False
    """Whether to open dm_control's viewer, which needs a display, instead of recording."""
    device: str = "cpu"
    """Device of renderer and policy: cpu, cuda or cuda:N."""
    renderer: RendererName = "raytrace"
    """Renderer: raytrace, this package's ray tracer, or mujoco_warp, MuJoCo Warp's."""
    appearance: AppearanceSettings | None = None
    """Appearance of the scenes (see conf/appearance); none for that of the policy's training."""


def run(settings: Command, folder: Path) -> tuple[int, None]:
    """Record videos of a policy; return the exit status."""
    policy = drone_rl.load_policy(settings.policy, outputs=settings.paths.outputs)
    from drone_rl.evaluation.video import film, view  # slow to import

    policy = policy.in_task(**settings.task)
    policy = policy.in_dynamics(**settings.dynamics) if settings.dynamics else policy
    names = ("greedy", "seed", "device", "renderer", "appearance")
    chosen = {k: getattr(settings, k) for k in names if getattr(settings, k) is not None}
    if settings.viewer:
        view(policy, **chosen)
    else:
        film(policy, folder, settings.episodes, **chosen)
    return 0, None
