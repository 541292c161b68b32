"""The exact map of what a policy does about one cube, as an object that shows itself."""

import dataclasses
import json
import time
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from drone_rl.config.verification import PlacesSettings
from drone_rl.evaluation.plots import regions
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.sim.vocabulary import SHOWN_MOVES
from drone_rl.utils.display import aligned, paragraph, picture, table
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import Bar, Progress
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seeding import fresh_seed, legacy_seed
from drone_rl.utils.text import say
from drone_rl.verification.prover.action_map import Look, PlaceMap, map_places
from drone_rl.verification.prover.arrangement import Window
from drone_rl.verification.prover.bounds import Painter
from drone_rl.verification.prover.policy_spec import make_subject, one_thread
from drone_rl.verification.text import PLACES, rows


@dataclasses.dataclass(frozen=True)
class Places:
    """What a greedy policy does about one cube, wherever that stands: areas, not samples."""

    policy: Policy
    settings: PlacesSettings
    places: PlaceMap = dataclasses.field(repr=False)
    """The cells."""
    numbers: dict[str, Any] = dataclasses.field(repr=False)
    """What they come to, as in `places.json`."""

    def at(self, ahead: float, left: float) -> str:
        """What it does about a cube there.

        Args:
            ahead: Metres from the camera to the cube's centre, straight ahead.
            left: The same to the left.

        Returns:
            The action's name.

        Raises:
            InputError: The place is none of the map's.
        """
        window = self.places.window
        if not (window.nearest < ahead < window.farthest and abs(left) < window.sideways):
            raise InputError(
                f"ahead={ahead}, left={left} is outside of the map; give {window.nearest:g} to "
                f"{window.farthest:g} metres ahead and up to {window.sideways:g} to either side"
            )
        return SHOWN_MOVES.names[self.places.at(np.array([[ahead, left]]))[0]]

    def save(self, folder: Path) -> None:
        """Writes `places.json`, `places.png` and `places.svg`, which can be zoomed into."""
        (folder / "places.json").write_text(json.dumps(self.numbers | provenance(), indent=2))
        ways = self.places.outlines()
        regions.chart(self.numbers, ways, SHOWN_MOVES).savefig(folder / "places.png", dpi=200)
        drawn = regions.svg(self.numbers, ways, SHOWN_MOVES)
        head = drawn.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1)
        (folder / "places.svg").write_text(head)

    def __str__(self) -> str:
        """The table and what it comes to."""
        return f"{aligned(rows(self.numbers, SHOWN_MOVES.names))}\n{self._about()}"

    def _repr_html_(self) -> str:
        head, *lines = rows(self.numbers, SHOWN_MOVES.names)
        figure = regions.chart(self.numbers, self.places.outlines(), SHOWN_MOVES)
        return table(head, lines) + paragraph(self._about()) + picture(figure)

    def _about(self) -> str:
        return say(PLACES, {"places": self.numbers})


def places(
    policy: str | Path | Policy,
    settings: PlacesSettings | None = None,
    *,
    task: Mapping[str, Any] | None = None,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    **changes: Any,
) -> Places:
    """Maps a greedy policy's action over the continuum of places of one cube, exactly.

    The picture of one cube changes only along straight lines of its places; all cells between them
    are found, and the network is asked about each one's picture.

    Args:
        policy: The policy, or what `load_policy` takes.
        settings: Which places.
        task: What to change of the policy's task.
        outputs: See `load_policy`.
        progress: Told of what is being done; a bar by default.
        changes: Settings to change, as in `places("good", farthest=40)`.

    Raises:
        InputError: The policy, its task or a setting is not for an exact map; the message says why.
    """
    settings, progress = (settings or PlacesSettings()).replace(**changes), progress or Bar()
    policy = policy if isinstance(policy, Policy) else load_policy(policy, outputs=outputs)
    policy = policy.in_task(**(task or {}))
    begin = time.perf_counter()
    network, gap = policy.make_network(), settings.logit_gap
    made = make_subject(policy.description, network, gap, settings.renderer)
    with one_thread(), closing(made) as subject:
        progress("comparing the renderer's pictures")
        compared = subject.seeing.check(
            settings.compared, np.random.RandomState(legacy_seed(fresh_seed()))
        )
        progress("deciding the cells")
        found = map_places(
            subject.eye,
            Window(settings.nearest, settings.farthest, settings.sideways),
            _look(subject.painter),
            network.eval(),
            touch_distance=subject.lattice.task.touch_distance,
            most_cells=settings.most_cells,
        )
    progress("mapped", 1, 1)
    numbers = {
        "policy": policy.name,
        "path": str(policy.path),
        "task": policy.task.values(),
        "names": list(SHOWN_MOVES.names),
        **found.summary(settings.logit_gap),
        "compared": compared,
        "seconds": time.perf_counter() - begin,
    }
    return Places(policy, settings, found, numbers)


def _look(painter: Painter) -> Look:
    """From what pixels show of a cube to what the network sees."""
    whole = (slice(None), slice(None))

    def look(faces: NDArray[np.uint8]) -> torch.Tensor:
        return painter.see(painter.paint_one([(whole, torch.from_numpy(faces))], len(faces)))

    return look
