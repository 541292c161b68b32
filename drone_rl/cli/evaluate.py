"""`drone-rl evaluate`."""

import json
import logging
from pathlib import Path
from typing import Annotated

import drone_rl
from drone_rl.cli.settings import RolloutCommandSettings
from drone_rl.config.commands import EvaluateSettings
from drone_rl.utils.progress import log
from drone_rl.utils.schema import Whole

_log = logging.getLogger(__name__)


class Command(RolloutCommandSettings, EvaluateSettings):
    """Settings of `drone-rl evaluate`."""

    videos: Annotated[int, Whole(0, unit="episodes")] = 2
    """Episodes recorded as MP4 and GIF; 0 for none."""
    greedy: bool = True
    """Whether the videos show the most probable actions instead of sampled ones."""


def run(settings: Command, folder: Path) -> tuple[int, float]:
    """Evaluate one policy; return the exit status and the success rate."""
    policy = drone_rl.load_policy(settings.policy, outputs=settings.paths.outputs)
    policy = policy.in_task(**settings.task)
    policy = policy.in_dynamics(**settings.dynamics) if settings.dynamics else policy
    done = drone_rl.evaluate(policy, settings, progress=log)
    (folder / "evaluation.json").write_text(json.dumps(done.as_dict(), indent=2))
    print(done)
    _log.info("policy: %s", policy.path)
    _log.info("written: %s", folder / "evaluation.json")
    if settings.videos:
        from drone_rl.evaluation.video import film

        film(
            policy,
            folder / "videos",
            settings.videos,
            greedy=settings.greedy,
            seed=done.seed.value,
            device=settings.device,
            renderer=settings.renderer,
        )
    return 0, done.success
