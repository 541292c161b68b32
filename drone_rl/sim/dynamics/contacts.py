# pyright: reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportOperatorIssue=false
# pyright: reportAttributeAccessIssue=false
# pyright: reportReturnType=false
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# (Warp compiles this file; Python's types say nothing about it.)
"""Where a drone touches ground or obstacles: it is a ball, they are planes and boxes."""

import warp as wp

from drone_rl.sim.dynamics.airframe import Airframe
from drone_rl.sim.dynamics.rigid_body import Motion

REST_SPEED = wp.constant(0.1)
"""Speed into a contact, metres a second, below which nothing bounces."""

wp.set_module_options({"enable_backward": False})


@wp.struct
class Overlap:
    """Of a ball and a thing."""

    normal: wp.vec3
    """Out of the thing."""
    depth: float
    """Metres; below 0 where they are apart."""


@wp.func
def box_overlap(center: wp.vec3, radius: float, half: wp.vec3) -> Overlap:
    """How a ball and a box stand to each other.

    Args:
        center: Of the ball, from the middle of the box, metres, along the box's axes.
        radius: Of the ball.
        half: Half the box's edges.
    """
    found = Overlap()
    nearest = wp.vec3(
        wp.clamp(center[0], -half[0], half[0]),
        wp.clamp(center[1], -half[1], half[1]),
        wp.clamp(center[2], -half[2], half[2]),
    )
    away = center - nearest
    distance = wp.length(away)
    if distance > 0.0:
        found.normal = away / distance
        found.depth = radius - distance
        return found
    inside = wp.vec3(
        half[0] - wp.abs(center[0]), half[1] - wp.abs(center[1]), half[2] - wp.abs(center[2])
    )
    if inside[0] <= inside[1] and inside[0] <= inside[2]:
        found.normal = wp.vec3(wp.sign(center[0]), 0.0, 0.0)
        found.depth = radius + inside[0]
    elif inside[1] <= inside[2]:
        found.normal = wp.vec3(0.0, wp.sign(center[1]), 0.0)
        found.depth = radius + inside[1]
    else:
        found.normal = wp.vec3(0.0, 0.0, wp.sign(center[2]))
        found.depth = radius + inside[2]
    return found


@wp.func
def bounced(frame: Airframe, velocity: wp.vec3, normal: wp.vec3) -> wp.vec3:
    """Velocity after a contact: Newton's restitution and Coulomb's friction, at the ball's middle.

    Args:
        frame: Restitution and friction.
        velocity: Before, metres a second.
        normal: Out of what is touched.
    """
    into = -wp.dot(velocity, normal)
    if into <= 0.0:
        return velocity
    share = 0.0
    if into > REST_SPEED:
        share = frame.restitution
    along = velocity + into * normal
    speed = wp.length(along)
    loss = frame.friction * (1.0 + share) * into
    kept = wp.max(speed - loss, 0.0) / wp.max(speed, 1.0e-9)
    return kept * along + share * into * normal


@wp.func
def pushed_out(frame: Airframe, motion: Motion, overlap: Overlap) -> Motion:
    """The motion of a drone that no longer reaches into a thing."""
    after = motion
    after.position = motion.position + overlap.depth * overlap.normal
    after.velocity = bounced(frame, motion.velocity, overlap.normal)
    return after
