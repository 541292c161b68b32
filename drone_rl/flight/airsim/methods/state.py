"""Methods that report, or set, the state of a vehicle."""

from collections.abc import Callable, Sequence
from typing import Any

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.messages import Map, flag, read_map, read_pose, read_vector
from drone_rl.flight.airsim.methods.registry import method, sim_vehicle_at, vehicle_at
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.sim.coordinates import GeoPoint


@method("getMultirotorState")
def _state(simulation: Simulation, args: Sequence[Any]) -> Map:
    return vehicle_at(simulation, args, 0).multirotor_state()


@method("simGetVehiclePose", "simGetPose")
def _pose(simulation: Simulation, args: Sequence[Any]) -> Map:
    return messages.pose(sim_vehicle_at(simulation, args, 0).pose)


@method("simSetVehiclePose", "simSetPose", least=2)
def _set_pose(simulation: Simulation, args: Sequence[Any]) -> None:
    vehicle = sim_vehicle_at(simulation, args, 2)
    ignore = flag(args[1], "ignore_collision")
    simulation.teleport(vehicle, read_pose(args[0]), ignore_collision=ignore)


@method("simGetGroundTruthKinematics")
def _kinematics(simulation: Simulation, args: Sequence[Any]) -> Map:
    return sim_vehicle_at(simulation, args, 0).kinematics()


@method("simSetKinematics", least=2)
def _set_kinematics(simulation: Simulation, args: Sequence[Any]) -> None:
    pose = read_pose(args[0], "state")
    velocity, rates = (
        read_vector(args[0].get(name), f"state.{name}")
        for name in ("linear_velocity", "angular_velocity")
    )
    vehicle = sim_vehicle_at(simulation, args, 2)
    vehicle.set_kinematics(pose, velocity, rates)
    simulation.touch(vehicle)


_STRATOSPHERE = 11_000.0
"""Altitude in metres from which temperature and pressure count as constant."""


@method("simGetGroundTruthEnvironment")
def _environment(simulation: Simulation, args: Sequence[Any]) -> Map:
    vehicle = sim_vehicle_at(simulation, args, 0)
    altitude = min(vehicle.geo_point()["altitude"], _STRATOSPHERE)
    kelvin = 288.15 - 0.0065 * altitude
    pressure = 101325.0 * (kelvin / 288.15) ** 5.25588
    return {
        "position": messages.vector(vehicle.pose.position),
        "geo_point": vehicle.geo_point(),
        "gravity": messages.vector((0.0, 0.0, 9.80665)),
        "air_pressure": pressure,
        "temperature": kelvin,
        "air_density": pressure / (287.05 * kelvin),
    }


@method("simGetCollisionInfo")
def _collision(simulation: Simulation, args: Sequence[Any]) -> Map:
    return sim_vehicle_at(simulation, args, 0).collision()


@method("getCollisionInfo")
def _legacy_collision(simulation: Simulation, args: Sequence[Any]) -> Map:
    return simulation.find("", is_sim_api=True).collision(is_legacy=True)


@method("getRotorStates")
def _rotors(simulation: Simulation, args: Sequence[Any]) -> Map:
    return vehicle_at(simulation, args, 0).rotor_states()


@method("simTestLineOfSightToPoint", least=1)
def _line_of_sight(simulation: Simulation, args: Sequence[Any]) -> bool:
    return sim_vehicle_at(simulation, args, 1).sees(_read_place(args[0]))


@method("simTestLineOfSightBetweenPoints", least=2)
def _line_between(simulation: Simulation, args: Sequence[Any]) -> bool:
    return simulation.find("", is_sim_api=True).sees(_read_place(args[0]), _read_place(args[1]))


def _read_place(value: Any) -> GeoPoint:
    return GeoPoint(*read_map(value, "point", ("latitude", "longitude", "altitude")))


@method("getHomeGeoPoint")
def _home_point(simulation: Simulation, args: Sequence[Any]) -> Map:
    vehicle_at(simulation, args, 0)
    return messages.geo_point(simulation.settings.home)


def _legacy(compute: Callable[[Vehicle], Any]) -> Callable[[Simulation, Sequence[Any]], Any]:
    return lambda simulation, args: compute(simulation.find(""))


method("getPosition")(_legacy(lambda v: v.kinematics()["position"]))
method("getVelocity")(_legacy(lambda v: v.kinematics()["linear_velocity"]))
method("getOrientation")(_legacy(lambda v: v.kinematics()["orientation"]))
method("getLandedState")(_legacy(lambda v: v.multirotor_state()["landed_state"]))
method("getGpsLocation")(_legacy(lambda v: v.geo_point()))
method("getRCData")(_legacy(lambda v: v.multirotor_state()["rc_data"]))


def _sensor(kind: str) -> Callable[[Simulation, Sequence[Any]], Map]:
    # the first argument is the sensor's name; each vehicle has one of a kind
    return lambda simulation, args: vehicle_at(simulation, args, 1).sensor(kind)


for _label in ("imu", "barometer", "magnetometer", "gps"):
    method(f"get{_label.title()}Data")(_sensor(_label))
