"""Inputs of policies that are vectors, measured in a kernel; see `drone_rl.envs.vectors`."""

import warp as wp

from drone_rl.sim.dynamics.moves_kernel import is_flying
from drone_rl.sim.dynamics.state import ATTITUDE, RATES, VELOCITY
from drone_rl.sim.tasks.rules_kernel import Episodes

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

MEASURED = ("goal", "velocity", "attitude", "rates", "altitude", "last_action")
"""Quantities that can be measured; the kernel numbers them in this order."""
FLOWN = ("velocity", "rates")
"""Those that need a drone in flight."""
_GOAL, _VELOCITY, _ATTITUDE, _RATES, _ALTITUDE, _ACTION = (
    wp.constant(MEASURED.index(name)) for name in MEASURED
)


@wp.struct
class Vectors:
    """The vectors of an observation."""

    quantities: wp.array[int]
    """Numbers of `MEASURED`."""
    scales: wp.array[float]
    """Each quantity is divided by it."""
    places: wp.array[int]
    """Index of the first number of each in an observation."""


@wp.func
def _body_from_world(attitude: wp.vec4d, vector: wp.vec3d) -> wp.vec3d:
    """Return a vector along the axes of a body; see `drone_rl.sim.coordinates`."""
    axis = wp.vec3d(-attitude[1], -attitude[2], -attitude[3])
    twice = wp.float64(2.0) * wp.cross(axis, vector)
    return vector + attitude[0] * twice + wp.cross(axis, twice)


@wp.func
def _write(vector: wp.vec3d, scale: float, target: wp.array[float], first: int) -> None:
    for i in range(3):
        target[first + i] = float(vector[i]) / scale


@wp.func
def _three(numbers: wp.array2d[wp.float64], env: int, first: int) -> wp.vec3d:
    return wp.vec3d(numbers[env, first], numbers[env, first + 1], numbers[env, first + 2])


@wp.func
def measure(  # noqa: C901 (a kernel has no table of functions)
    vectors: Vectors, envs: Episodes, env: int, target: wp.array[float]
) -> None:
    """Write the vectors of an environment to its observation."""
    numbers = envs.fleet.numbers
    attitude = envs.attitudes[env]
    if is_flying(envs.fleet):
        for i in range(4):
            attitude[i] = numbers[env, ATTITUDE + i]
    for k in range(vectors.quantities.shape[0]):
        quantity, scale, at = vectors.quantities[k], vectors.scales[k], vectors.places[k]
        if quantity == _GOAL:
            ahead = envs.world.ahead[env]
            away = wp.vec3d()
            if ahead >= 0:
                away = envs.world.objects.places[env, ahead] - envs.drones[env]
                away = _body_from_world(attitude, away)
            _write(away, scale, target, at)
        if quantity == _VELOCITY:
            velocity = _body_from_world(attitude, _three(numbers, env, VELOCITY))
            _write(velocity, scale, target, at)
        if quantity == _RATES:
            _write(_three(numbers, env, RATES), scale, target, at)
        if quantity == _ATTITUDE:
            sign = wp.where(attitude[0] < wp.float64(0.0), wp.float64(-1.0), wp.float64(1.0))
            for i in range(4):
                target[at + i] = float(sign * attitude[i]) / scale
        if quantity == _ALTITUDE:
            target[at] = float(envs.drones[env][2]) / scale
        if quantity == _ACTION:
            for i in range(4):
                target[at + i] = envs.world.actions[env][i] / scale


@wp.func
def measure_nothing(vectors: Vectors, envs: Episodes, env: int, target: wp.array[float]) -> None:
    """Do the same without vectors."""
    return
