"""Fields of pillars: where they stand, and the lanes that lead through.

A drone that moves in steps is always in one of finitely many lanes, a step apart. Rows stand so far
apart that between two of them every lane can be changed for any other; so a field is crossed by
some path if, and only if, each of its rows leaves a lane open.
"""

import numpy as np
from numpy.typing import NDArray

from drone_rl.config import PillarsSettings

MOST_TRIES = 10_000
"""Drawings of a row until one leaves a way through."""


def lanes(settings: PillarsSettings) -> NDArray[np.float64]:
    """The y of all lanes within the field, metres, from right to left. Shape: (L,)."""
    most = int(settings.spread / settings.step_length + 1e-9)
    return np.arange(-most, most + 1, dtype=np.float64) * settings.step_length


def draw_rows(
    settings: PillarsSettings, random_state: np.random.RandomState, count: int
) -> NDArray[np.float64]:
    """Rows as they come, be they open or not: the y of their pillars. Shape: (count, K)."""
    return random_state.uniform(-settings.spread, settings.spread, (count, settings.row_size))


def is_open(settings: PillarsSettings, rows: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which lanes lead through rows.

    Args:
        settings: The task's.
        rows: The y of their pillars, metres. Shape: (*, K).

    Returns:
        Shape: (*, L).
    """
    away = np.abs(rows[..., None, :] - lanes(settings)[:, None])
    return np.asarray((away > settings.touch_distance).all(-1))


def draw_field(
    settings: PillarsSettings, random_state: np.random.RandomState
) -> NDArray[np.float64]:
    """The y of all pillars of a field that some path crosses. Shape: (num_rows, K), metres.

    Raises:
        RuntimeError: None was found; settings of which this is to be feared are refused.
    """
    rows = draw_rows(settings, random_state, settings.num_rows)
    for _ in range(MOST_TRIES):
        closed = ~is_open(settings, rows).any(-1)
        if not closed.any():
            return rows
        rows[closed] = draw_rows(settings, random_state, int(closed.sum()))
    raise RuntimeError(f"no open field in {MOST_TRIES} drawings")
