"""`drone-rl evaluate`."""

import dataclasses
import json
import logging
from pathlib import Path
from typing import Annotated

import drone_rl
from drone_rl.cli.hydra.resuming import policies as prepare  # noqa: F401 -- of what was typed
from drone_rl.config.commands import EvaluateSettings, PathsSettings
from drone_rl.config.configuration import DynamicsChanges, TaskChanges, no_changes
from drone_rl.utils.schema import Whole

_log = logging.getLogger(__name__)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Command(EvaluateSettings):
    """What `drone-rl evaluate` can be told."""

    policy: str = "latest"
    """What to evaluate, see `drone_rl.load_policy`."""
    videos: Annotated[int, Whole(0, unit="episodes")] = 2
    """Episodes filmed as MP4 and GIF; 0 for none."""
    greedy: bool = True
    """Whether the films show the most probable actions instead of drawn ones."""
    task: TaskChanges = no_changes()
    """What to change of the policy's task."""
    dynamics: DynamicsChanges = no_changes()
    """What to change of how the policy's drone moves."""
    paths: PathsSettings = PathsSettings()
    """Folders."""


def run(settings: Command, folder: Path) -> tuple[int, float]:
    """Evaluates one policy. Returns the exit status and the share of complete episodes."""
    from drone_rl.utils.progress import log

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
