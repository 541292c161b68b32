"""A pilot in a notebook: what is known of the drone, and its way from above."""

import html

from drone_rl.flight.commands.state import PilotState
from drone_rl.flight.commands.trajectory import Trajectory

_SIZE = 160.0
"""Pixels of the picture."""
_POINTS = 400
"""Of the way, at most."""


def shown(state: PilotState, trajectory: Trajectory) -> str:
    """A small table and a picture, as HTML that needs no file.

    Args:
        state: Of the drone.
        trajectory: Where it has been.
    """
    rows = "".join(
        f"<tr><td>{name}</td><td>{html.escape(text)}</td></tr>" for name, text in _rows(state)
    )
    return f'<div style="display: flex; gap: 1em"><table>{rows}</table>{way(trajectory)}</div>'


def way(trajectory: Trajectory) -> str:
    """The way from above, as SVG: x up, y to the left."""
    step = max(1, len(trajectory) // _POINTS)
    places = trajectory.positions[::step, :2]
    low, high = places.min(0), places.max(0)
    scale = (_SIZE - 20.0) / max(float((high - low).max()), 1.0)
    across, up = 10.0 + scale * (high - places).T[::-1]
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in zip(across, up, strict=True))
    return (
        f'<svg width="{_SIZE:.0f}" height="{_SIZE:.0f}"><polyline points="{points}" fill="none" '
        'stroke="currentColor"/></svg>'
    )


def _rows(state: PilotState) -> list[tuple[str, str]]:
    angles = state.attitude
    touched = state.collision
    return [
        ("time", f"{state.time:.2f} s"),
        ("state", f"{state.landed}, {'armed' if state.armed else 'disarmed'}"),
        ("position", "{:.2f}, {:.2f}, {:.2f} m".format(*state.position)),
        ("velocity", "{:.2f}, {:.2f}, {:.2f} m/s".format(*state.velocity)),
        ("roll, pitch, yaw", f"{angles.roll:.1f}, {angles.pitch:.1f}, {angles.yaw:.1f} degrees"),
        ("touched", f"{touched.thing}, {touched.time:.2f} s" if touched else "nothing"),
    ]
