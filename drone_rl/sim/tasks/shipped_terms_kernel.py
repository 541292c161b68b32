"""The functions of the terms that any task can name without a file of its own."""

import warp as wp

from drone_rl.config.terms import ENDS, EVENTS, REWARDS, SUCCESSES
from drone_rl.sim.tasks.step_kernel import Mover, Step


@REWARDS.implement("progress")
def progress(step: Step) -> wp.float64:
    """Metres by which the drone has come nearer to its goal; in `pillars` a fraction of the way."""
    return step.exact_progress


@REWARDS.implement("reached")
def reached(step: Step) -> float:
    """Number of goals reached."""
    return float(step.reached)


@REWARDS.implement("contact")
def contact(step: Step) -> float:
    """1 in contact with an obstacle, the ground or the scene."""
    return wp.where(step.contact, 1.0, 0.0)


@REWARDS.implement("time")
def time(step: Step) -> float:
    """1 in every step."""
    return 1.0


@REWARDS.implement("control")
def control(step: Step) -> float:
    """Sum of the squared speeds that are commanded, as fractions of the greatest ones."""
    return wp.length_sq(step.action)


@REWARDS.implement("smoothness")
def smoothness(step: Step) -> float:
    """Sum of the squared differences of the commanded speeds from those of the step before."""
    return wp.length_sq(step.action - step.last_action)


@REWARDS.implement("facing")
def facing(step: Step) -> float:
    """Cosine of the horizontal angle between the drone's heading and its goal."""
    flat = wp.sqrt(step.goal[0] * step.goal[0] + step.goal[1] * step.goal[1])
    return wp.where(flat > 0.0, step.goal[0] / flat, 0.0)


@REWARDS.implement("altitude")
def altitude(step: Step, height: float) -> float:
    """Metres between the drone's altitude and `height`."""
    return wp.abs(step.position[2] - height)


@ENDS.implement("contact")
def touches(step: Step) -> bool:
    """The drone touches an obstacle, the ground or the scene."""
    return step.contact


@ENDS.implement("out_of_bounds")
def is_out_of_bounds(step: Step) -> bool:
    """The drone leaves the task's bounds."""
    return step.out_of_bounds


@SUCCESSES.implement("all_goals")
def has_all_goals(step: Step) -> bool:
    """The drone has reached every goal."""
    return step.remaining == 0


@EVENTS.implement("orbit")
def orbit(mover: Mover, radius: float = 2.0, period: float = 10.0) -> wp.vec3:
    """Flies a circle of `radius` metres in `period` seconds, at first in a random direction."""
    angle = wp.tau * (mover.time / period + mover.phase)
    return wp.tau * radius / period * wp.vec3(wp.cos(angle), wp.sin(angle), 0.0)


@EVENTS.implement("shuttle")
def shuttle(
    mover: Mover, distance: float = 2.0, period: float = 10.0, heading: float = 90.0
) -> wp.vec3:
    """Goes to and fro in `period` seconds, at most `distance` metres to each side of its place.

    The heading of its path is in degrees to the left of x; it begins anywhere in the period.
    """
    turn = mover.time / period + mover.phase
    speed = wp.where(turn - wp.floor(turn) < 0.5, 2.0, -2.0) * distance / period
    return speed * wp.vec3(wp.cos(wp.radians(heading)), wp.sin(wp.radians(heading)), 0.0)
