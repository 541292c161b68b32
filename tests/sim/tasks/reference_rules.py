"""A reference implementation of the rules of cube collection in torch."""

import torch

from drone_rl.sim.tasks.collect_cubes import EndReason, Side


def step(settings, state, body):
    """Return the fields of the state after a step, and the reward."""
    drone = body.position
    away = (drone[:, None] - state.cubes).abs().amax(-1)  # (N, C)
    touched = state.present & (away <= settings.touch_distance)
    collected = state.collected | touched
    passed = state.passed | (~collected & (drone[:, None, 0] > state.cubes[..., 0]))
    side, lateral = sightings(settings, state, drone, ~(collected | passed))
    x, y, _ = drone.unbind(-1)
    reason = (
        torch.zeros_like(state.steps)
        .masked_fill(state.steps + 1 >= settings.step_limit, EndReason.STEP_LIMIT)
        .masked_fill(y.abs() > settings.side_bound, EndReason.SIDE_BOUNDARY)
        .masked_fill(x > settings.front_bound, EndReason.FRONT_BOUNDARY)
        .masked_fill(collected.all(-1), EndReason.ALL_CUBES)
        .masked_fill(body.is_lost, EndReason.LOST_CONTROL)
    )
    new = {"collected": collected, "passed": passed, "side": side, "lateral": lateral}
    return {**new, "end_reason": reason}, touched.sum(-1, dtype=torch.float64)


def sightings(settings, state, drone, present):
    """Return side and lateral offset recorded for each cube up to the next one."""
    offset = state.cubes[..., 1] - drone[:, None, 1]
    right = torch.where(offset < -settings.touch_distance, Side.RIGHT.value, Side.AHEAD.value)
    side = torch.where(offset > settings.touch_distance, Side.LEFT.value, right)
    next_cube = (~present).long().cumprod(-1).sum(-1)
    is_new = (state.side < 0) & (torch.arange(side.shape[-1]) <= next_cube[:, None])
    return torch.where(is_new, side, state.side), torch.where(is_new, offset, state.lateral)
