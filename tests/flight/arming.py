"""Arming without the seconds in which a real firmware calibrates its sensors."""

from drone_rl.flight.in_the_loop.drone import DroneInTheLoop


def arm_at_once(patch, settle=0.1, within=1.0):
    """Let drones in the loop settle for `settle` seconds by default: the stub has no sensors."""
    patch.setattr(DroneInTheLoop.arm, "__defaults__", (3, settle, within))
