"""`drone-rl places`: the exact map of a greedy policy's action over all positions of one cube."""

import time
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pydantic import Field

from drone_rl.config.commands import PlacesSettings
from drone_rl.config.configuration import from_arguments
from drone_rl.envs import Pipeline
from drone_rl.explanations.report.places import chart, describe, rows
from drone_rl.explanations.results import ExactMap, Outlines
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.sim.vocabulary import SHOWN_MOVES
from drone_rl.trust.plots.saving import save_drawn
from drone_rl.utils.display import TableResult
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import Progress, as_progress
from drone_rl.utils.provenance import Provenance, provenance
from drone_rl.utils.seeding import fresh_seed, legacy_seed
from drone_rl.utils.threads import torch_threads
from drone_rl.verification.prover.action_map import ActionMap, map_policy
from drone_rl.verification.prover.policy_spec import make_policy_spec


class Places(TableResult, ExactMap, Provenance):
    """The actions of a greedy policy over all positions of one cube, as in `places.json`."""

    policy: str
    """Its name."""
    path: str
    task: dict[str, Any]
    """Settings of the task."""
    names: tuple[str, ...] = SHOWN_MOVES.names
    """Of the actions."""
    compared: int
    """Rendered images that equal the closed form."""
    seconds: float
    share: float = Field(1.0, exclude=True)
    outlines: Outlines = Field(exclude=True)
    places: ActionMap = Field(exclude=True)
    """The cells."""

    def at(self, ahead: float, left: float) -> str:
        """Return the action for a cube at a position.

        Args:
            ahead: Metres ahead of the camera to the cube's centre.
            left: Metres to the left of the camera.

        Returns:
            The action's name.

        Raises:
            InputError: The position is outside the map.
        """
        window = self.places.window
        if not (window.nearest < ahead < window.farthest and abs(left) < window.sideways):
            raise InputError(
                f"ahead={ahead}, left={left} is outside of the map; give more than "
                f"{window.nearest:g} and less than {window.farthest:g} metres ahead, and less than "
                f"{window.sideways:g} to either side"
            )
        return SHOWN_MOVES.names[self.places.at(np.array([[ahead, left]]))[0]]

    def save(self, folder: Path) -> None:
        """Write `places.json`, `places.png` and the zoomable `places.svg`."""
        self.write_json(folder / "places.json")
        save_drawn(self.figure(), folder / "places")

    def rows(self) -> list[list[str]]:
        """Return the fractions of the area as a table: a header, then a row for each side."""
        return rows(self, self.names)

    def notes(self) -> list[str]:
        """Return the findings in words."""
        return [describe(self, self.names)]

    def figure(self) -> Figure:
        """Return the map."""
        return chart(self, SHOWN_MOVES)


def places(
    policy: str | Path | Policy,
    settings: PlacesSettings | None = None,
    *,
    task: Mapping[str, Any] | None = None,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    **changes: Any,
) -> Places:
    """Map a greedy policy's action over all positions of one cube, exactly.

    The image of one cube changes only along straight lines of its position. All cells between these
    lines are found, and the network is evaluated on each cell's image.

    Args:
        policy: The policy, or an argument of `load_policy`.
        settings: Which positions.
        task: Changes to the policy's task.
        outputs: See `load_policy`.
        progress: Called with the progress; a bar by default.
        changes: Changes to the settings, as in `places("good", farthest=40)`.

    Raises:
        InputError: The policy, its task or a setting is not supported; the message says why.
    """
    settings = from_arguments(PlacesSettings, settings, changes, places)
    progress = as_progress(progress)
    policy = load_policy(policy, outputs=outputs).in_task(task)
    begin = time.perf_counter()
    network, gap = policy.make_network(), settings.logit_gap
    spec = make_policy_spec(policy.description, network, gap, settings.renderer)
    transform = Pipeline(policy.description.make_transforms())
    with torch_threads(1), closing(spec):
        progress("comparing the renderer's images", 0, 2)
        compared = spec.images.check(
            settings.compared, np.random.RandomState(legacy_seed(fresh_seed()))
        )
        progress("deciding the cells", 1, 2)
        action_map = map_policy(spec.images, transform, network, settings)
    progress("mapped", 2, 2)
    return Places(
        **dict(action_map.summary(settings.logit_gap)),
        policy=policy.name,
        path=str(policy.path),
        task=policy.task.values(),
        places=action_map,
        compared=compared,
        seconds=time.perf_counter() - begin,
        **provenance(),
    )
