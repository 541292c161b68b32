# pyright: reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportOperatorIssue=false
# pyright: reportAttributeAccessIssue=false
# pyright: reportReturnType=false
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# (Warp compiles this file; Python's types say nothing about it.)
"""Gusts: air whose velocity wanders, along each axis with Dryden's longitudinal spectrum.

That is white noise through a filter of first order whose time constant is the length scale over the
airspeed (MIL-F-8785C). The vertical and lateral spectra of the same model, of second order, are
taken to be of first order too.
"""

import warp as wp

from drone_rl.sim.dynamics.airframe import Airframe

SLOWEST = wp.constant(1.0)
"""Airspeed in metres a second below which gusts change no slower."""
_SPREAD = wp.constant(3.4641016151377544)
"""Width of a uniform distribution of variance 1."""

wp.set_module_options({"enable_backward": False})


@wp.func
def gust_after(
    frame: Airframe, gust: wp.vec3, airspeed: float, seed: wp.int64, tick: wp.int64
) -> wp.vec3:
    """The air's velocity beside its mean, a tick later.

    Args:
        frame: How strong gusts are, and how long.
        gust: Before. Metres a second, world frame.
        airspeed: Of the drone through air without gusts, metres a second. (With them, gusts that
            blow against the wind would last longer than others, and the mean be less than it.)
        seed: Of the episode.
        tick: Number of the tick in the episode; each is of its own randomness.
    """
    decay = wp.exp(-frame.tick * wp.max(airspeed, SLOWEST) / frame.gust_length)
    strength = _SPREAD * frame.gusts * wp.sqrt(1.0 - decay * decay)
    source = wp.rand_init(wp.int32(seed & wp.int64(0x7FFFFFFF)), wp.int32(tick))
    noise = wp.vec3(wp.randf(source) - 0.5, wp.randf(source) - 0.5, wp.randf(source) - 0.5)
    return decay * gust + strength * noise
