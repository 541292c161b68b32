"""What a drone was last touched by, remembered until somebody asks."""

import dataclasses

import torch
from torch import Tensor

from drone_rl.sim.dynamics.flight_state import GROUND, NOTHING, Contact
from drone_rl.utils.batch import Batch


@dataclasses.dataclass
class CollisionState(Batch):
    """What `num_worlds` drones remember. World frame, SI units."""

    has_collided: Tensor  # (num_worlds,) bool
    """Whether there was a contact that nobody has read of yet."""
    contact: Contact
    """The last one; it stays when it has been read."""
    position: Tensor  # (num_worlds, 3) float64
    """Where the drone was then, metres."""


def start(position: Tensor) -> CollisionState:
    """Drones that were never touched.

    Args:
        position: Metres, world frame. Shape: (num_worlds, 3), float64.
    """
    untouched = torch.zeros(len(position), dtype=torch.bool, device=position.device)
    numbers, zeros = torch.full_like(untouched, NOTHING, dtype=torch.int64), position.new_zeros
    nowhere, flat = zeros(position.shape), zeros(len(position))
    nothing = Contact(numbers, nowhere, nowhere.clone(), flat, flat.clone())
    return CollisionState(untouched, nothing, nowhere.clone())


def update(state: CollisionState, contact: Contact, position: Tensor) -> CollisionState:
    """The same drones later.

    Args:
        state: Before; it stays as it is.
        contact: What each last touched, with the time of it: a touch is news where its time, or the
            thing, is another than that of the one remembered. A drone that rests on something
            touches it at every tick.
        position: Of the drones now, metres, world frame. Shape: (num_worlds, 3).
    """
    known = state.contact
    is_other = (contact.thing != known.thing) | (contact.time != known.time)
    is_news = (contact.thing != NOTHING) & is_other
    own = {k: _where(is_news, v, getattr(known, k)) for k, v in vars(contact).items()}
    return CollisionState(
        state.has_collided | is_news, Contact(**own), _where(is_news, position, state.position)
    )


def read(
    state: CollisionState, worlds: Tensor | None = None
) -> tuple[CollisionState, CollisionState]:
    """What is known, and the same with the flag cleared, as AirSim clears it by telling it.

    Args:
        state: Before; it stays as it is.
        worlds: Indices of the drones that are asked; all by default. Shape: (k,).

    Returns:
        What to tell of the drones that were asked, and what all of them remember from now on.
    """
    worlds = torch.arange(len(state), device=state.position.device) if worlds is None else worlds
    flag = state.has_collided.clone()
    flag[worlds] = False
    return state[worlds], dataclasses.replace(state, has_collided=flag)


def thing_name(thing: int, kind: str = "obstacle") -> str:
    """Name of a thing by its number in `Contact`; empty for nothing.

    Args:
        thing: The number.
        kind: What the task's things are called.
    """
    if thing == NOTHING:
        return ""
    return "ground" if thing == GROUND else f"{kind}_{thing}"


def _where(condition: Tensor, chosen: Tensor, other: Tensor) -> Tensor:
    return torch.where(condition.view(-1, *[1] * (chosen.ndim - 1)), chosen, other)
