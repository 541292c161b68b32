"""The oracle of tasks in scenes: it follows the shortest path through free space."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.actions import MOVE_SETS, PARTS, Actions, DiscreteActions
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.dynamics import Dynamics, FlightState
from drone_rl.sim.dynamics.control import HEADING
from drone_rl.sim.dynamics.state import heading_of
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.scenes.path_kernel import Grid, Route, make_paths, path_lengths
from drone_rl.sim.tasks.objects import ObjectState

_DIRECTIONS = 24
"""Headings that a drone with continuous actions compares."""
_SLOPES = (-1.0, 0.0, 1.0)
"""Slopes that it compares if it climbs."""
_BETWEEN = (0.25, 0.5, 0.75, 1.0)
"""Where moves are checked for contacts, as fractions of them."""
_ROOM = 0.02
"""Metres that the oracle keeps from solids where it can."""
_DANGER = 100.0
"""Metres of path that a metre too near to solids is worth."""
_FLYING_ROOM, _FLYING_DANGER = 0.3, 5.0
"""The same for drones with dynamics, besides."""
_TURN = 0.01
"""Metres of path that a turn is worth, so that drones turn to the nearer side."""
_LOOK = 0.5
"""Seconds that a flying drone looks ahead."""
_SLOW, _FASTEST, _HURRY = 0.5, 2.0, 1.0
"""Metres a second next to solids and at most; more of them for each metre of room."""
_SLOWEST = 0.2
"""Fraction of the speed at which it flies on in another direction than it has to."""
_CORRECTION = 1.5
"""How much more than the wanted change of velocity a flying drone commands."""


class PathOracle:
    """Chooses the move after which the path is shortest; see `OracleRule`."""

    reads: tuple[str, ...] = ()
    actions: Actions = MOVE_SETS["moves_turning"]

    def __init__(
        self,
        routes: Sequence[Route],
        clearances: Sequence[Grid],
        routes_of: Callable[[ObjectState], Tensor],
        *,
        radius: float,
        step: float,
    ) -> None:
        """Take routes, and what the task knows.

        Args:
            routes: Where paths lead.
            clearances: Distances to solids around each route.
            routes_of: Returns the number of the route to each object, (N, P), -1 for none.
            radius: Of the drone, metres.
            step: Length of a move, metres.
        """
        start_warp("cpu")
        nowhere = (0.0, 0.0, 0.0)
        rooms = [Route(grid, nowhere, nowhere, 0.0) for grid in clearances]
        self._paths, self._rooms = make_paths(routes, "cpu"), make_paths(rooms, "cpu")
        self._routes_of, self._radius, self._step = routes_of, radius, step

    def can_fly(self, actions: Actions) -> bool:
        """Return whether the actions are moves or speeds that this package knows."""
        return isinstance(actions, DiscreteActions | ContinuousActions) and all(
            name in PARTS for name in actions.names
        )

    def choose(self, worlds: Any, state: ObjectState) -> Tensor:
        """Return actions in states of worlds. Shape: (N,) and then the entry's."""
        dynamics, device = worlds.dynamics, state.places.device
        state = state.to("cpu")
        actions = dynamics.actions
        choose = self._speeds if isinstance(actions, ContinuousActions) else self._move
        return choose(state, dynamics).to(device)

    def _move(self, state: ObjectState, dynamics: Dynamics) -> Tensor:
        """Return the numbers of moves and turns."""
        names, actions = dynamics.actions.names, dynamics.actions
        turn = _turn_of(dynamics)
        most = round(math.pi / turn) if turn else 0
        turns = torch.arange(-most, most + 1)
        ahead = [i for i, name in enumerate(names) if any(PARTS[name].speeds[:3])]
        moves = torch.tensor([PARTS[names[i]].speeds[:3] for i in ahead]).double() * self._step
        heading = heading_of(state.body.attitude)[:, None] + turns * turn
        cost = self._cost(state, _level(moves, heading)) + _TURN * turns.abs()[:, None]
        best = cost.flatten(1).argmin(1)
        turned, move = turns[best // len(ahead)], torch.tensor(ahead)[best % len(ahead)]
        for name, sign in (("turn left", 1), ("turn right", -1)):
            if name in names:
                move = torch.where(turned.sign() == sign, names.index(name), move)
        return move.to(actions.entry.dtype)

    def _speeds(self, state: ObjectState, dynamics: Dynamics) -> Tensor:
        """Return speeds along the path, slow next to solids, and turns to where it leads."""
        actions: Any = dynamics.actions
        forward, left, turn, climb = actions.speeds
        body, flies = state.body, isinstance(state.body, FlightState)
        velocity = body.velocity.double() if flies else torch.zeros_like(body.position)
        way = self._way(state, _LOOK * velocity, can_climb=climb > 0)
        routes, places = self._goals(state)
        room = self._at(self._rooms, routes, 0 * places, body.position[:, None])[:, 0]
        speed = (_SLOW + _HURRY * (room - self._radius)).clamp(_SLOW, _FASTEST)
        now = velocity.norm(dim=-1)
        agreeing = ((velocity * way).sum(-1) / now.clamp(min=_SLOW)).clamp(_SLOWEST, 1.0)
        wanted = torch.where(now > _SLOW, speed * agreeing, speed)[:, None] * way
        heading, seconds = heading_of(body.attitude), dynamics.timestep or 1.0
        aim = torch.atan2(way[:, 1], way[:, 0]) - heading
        aim = torch.atan2(aim.sin(), aim.cos())
        turned = (aim / (turn * seconds)).clamp(-1, 1) if turn else torch.zeros_like(aim)
        if flies:  # and turns meanwhile
            wanted = wanted + _CORRECTION * (wanted - velocity)
            heading = heading + 0.5 * turned * turn * seconds
        x, y, up = wanted.unbind(-1)
        along = (heading.cos() * x + heading.sin() * y) / forward
        aside = (heading.cos() * y - heading.sin() * x) / left
        back = actions.backward
        ahead = 2 * (along.clamp(-back, 1) + back) / (1 + back) - 1
        numbers = [ahead, aside, turned, up / climb if climb else up]
        return torch.stack(numbers[: actions.entry.shape[0]], -1).clamp(-1, 1).float()

    def _way(self, state: ObjectState, drift: Tensor, *, can_climb: bool) -> Tensor:
        """Return unit vectors along the path, after a drift, (N, 3), metres. Shape: (N, 3)."""
        angles = torch.arange(_DIRECTIONS).double() * (2 * math.pi / _DIRECTIONS)
        up = torch.tensor(_SLOPES if can_climb else (0.0,)).double()
        ways = torch.stack([torch.ones_like(up), torch.zeros_like(up), up], -1)
        ways = _level(ways / ways.norm(dim=-1, keepdim=True), angles[None])[0].flatten(0, 1)
        cost = self._cost(state, (self._step * ways).expand(len(state), -1, -1), drift)
        return ways[cost.argmin(1)]

    def _cost(self, state: ObjectState, moves: Tensor, drift: Tensor | float = 0.0) -> Tensor:
        """Return path lengths after moves, world frame, (N, *, 3); more too near to solids."""
        shape = moves.shape[:-1]
        start = (state.body.position + drift)[:, None]
        flat = moves.flatten(1, -2)
        ends = start + flat
        between = start[:, :, None] + flat[:, :, None] * torch.tensor(_BETWEEN)[:, None].double()
        routes, places = self._goals(state)
        room = self._at(self._rooms, routes, 0 * places, between.flatten(1, 2))
        room = room.unflatten(1, (-1, len(_BETWEEN)))
        left = room.amin(-1) - self._radius
        danger = _DANGER * (_ROOM - left).clamp(min=0)
        if isinstance(state.body, FlightState):
            danger = danger + _FLYING_DANGER * (_FLYING_ROOM - left).clamp(min=0)
        return (self._at(self._paths, routes, places, ends) + danger).reshape(shape)

    def _goals(self, state: ObjectState) -> tuple[Tensor, Tensor]:
        """Return the number of the route to each drone's goal, (N,), and its centre, (N, 3)."""
        rows, ahead = torch.arange(len(state)), state.ahead.long().clamp(min=0)
        return self._routes_of(state)[rows, ahead].clamp(min=0), state.places[rows, ahead]

    def _at(self, paths: Any, routes: Tensor, places: Tensor, points: Tensor) -> Tensor:
        """Return values of routes at points, (N, n, 3)."""
        values = torch.empty(points.shape[:2], dtype=torch.float64)
        inputs = [
            paths,
            wp.from_torch(routes.int().contiguous()),
            wp.from_torch(places.contiguous(), dtype=wp.vec3d),
            wp.from_torch(points.contiguous(), dtype=wp.vec3d),
            wp.from_torch(values),
        ]
        wp.launch(path_lengths, values.shape, inputs=inputs, device="cpu")
        return values


def _turn_of(dynamics: Any) -> float:
    """Return the angle of a discrete turn, radians; 0 for none."""
    if dynamics.timestep is not None:  # a quadrotor, whose heading drifts
        return float(dynamics.steering.drifts[:, HEADING].max()) * dynamics.timestep
    return float(2 * torch.atan2(*dynamics.turns.flip(-1).unbind(-1)).max())


def _level(moves: Tensor, heading: Tensor) -> Tensor:
    """Return moves in the drones' frame, (M, 3), in the world's, (N, H, M, 3).

    Headings are radians, shape (N, H).
    """
    cos, sin = heading.cos()[..., None], heading.sin()[..., None]
    x, y, up = moves.unbind(-1)
    return torch.stack([cos * x - sin * y, sin * x + cos * y, up.expand_as(cos * x)], -1)
