"""Methods that report, or set, the state of a vehicle."""

import math
from typing import Any

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.messages import (
    Map,
    Pose,
    flag,
    nanoseconds,
    ned,
    read_map,
    read_pose,
    text,
)
from drone_rl.flight.airsim.methods.registry import (
    VEHICLE,
    given,
    method,
    vehicle_method,
)
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.sim.coordinates import GeoPoint, ned_attitude_from_world
from drone_rl.sim.sensors.instruments import standard_pressure

vehicle_method("getMultirotorState")(Vehicle.multirotor_state)
vehicle_method("getRotorStates")(Vehicle.rotor_states)
vehicle_method("simGetVehiclePose simGetPose")(lambda vehicle: messages.pose(vehicle.pose))
vehicle_method("simGetGroundTruthKinematics")(Vehicle.kinematics)
vehicle_method("simGetCollisionInfo")(Vehicle.collision)

# of version 1.1
vehicle_method("getCollisionInfo")(lambda vehicle: vehicle.collision(is_legacy=True))
vehicle_method("getPosition")(lambda vehicle: vehicle.kinematics()["position"])
vehicle_method("getVelocity")(lambda vehicle: vehicle.kinematics()["linear_velocity"])
vehicle_method("getOrientation")(lambda vehicle: vehicle.kinematics()["orientation"])
vehicle_method("getLandedState")(lambda vehicle: vehicle.multirotor_state()["landed_state"])
vehicle_method("getGpsLocation")(Vehicle.geo_point)
vehicle_method("getRCData")(lambda vehicle: vehicle.multirotor_state()["rc_data"])


def _time(seconds: float, vehicle: Vehicle) -> int:
    """Return the time stamp of a reading; 0 if there is none yet."""
    return vehicle.epoch + nanoseconds(seconds) if math.isfinite(seconds) else 0


def _imu(vehicle: Vehicle) -> Map:
    reading = vehicle.sensors.imu()
    turn = ned_attitude_from_world(reading.attitude).tolist()
    return {
        "time_stamp": _time(reading.time, vehicle),
        "orientation": messages.quaternion(turn),
        "angular_velocity": messages.vector(ned(reading.angular_velocity)),
        "linear_acceleration": messages.vector(ned(reading.specific_force)),
    }


def _barometer(vehicle: Vehicle) -> Map:
    reading = vehicle.sensors.barometer()
    return {
        "time_stamp": _time(reading.time, vehicle),
        "altitude": reading.altitude,
        "pressure": reading.pressure,
        "qnh": vehicle.sensors.settings.barometer.sea_level_pressure,
    }


def _magnetometer(vehicle: Vehicle) -> Map:
    reading = vehicle.sensors.magnetometer()
    return {
        "time_stamp": _time(reading.time, vehicle),
        "magnetic_field_body": messages.vector(ned(reading.field)),
        "magnetic_field_covariance": [],
    }


def _gps(vehicle: Vehicle) -> Map:
    reading = vehicle.sensors.gps()
    return {
        "time_stamp": _time(reading.time, vehicle),
        "gnss": {
            "geo_point": messages.geo_point(reading.place.tolist()),
            "eph": reading.error,
            "epv": reading.error,
            "velocity": messages.vector(ned(reading.velocity)),
            "fix_type": int(reading.fix),
            "time_utc": _time(reading.time, vehicle) // 1000,
        },
        "is_valid": reading.is_valid,
    }


for _names, _read in (
    ("getImuData", _imu),
    ("getBarometerData", _barometer),
    ("getMagnetometerData", _magnetometer),
    ("getGpsData", _gps),
):  # of each there is one, whatever its name
    vehicle_method(_names, given(text, "sensor_name", default=""))(
        lambda vehicle, _, read=_read: read(vehicle)
    )


@method(
    "simSetVehiclePose simSetPose",
    given(read_pose, "pose"),
    given(flag, "ignore_collision"),
    VEHICLE,
)
def _set_pose(simulation: Simulation, pose: Pose, ignore_collision: bool, vehicle: Vehicle) -> None:
    simulation.teleport(vehicle, pose, ignore_collision=ignore_collision)


def _read_kinematics(value: Any, name: str) -> tuple[Pose, list[float], list[float]]:
    pose = read_pose(value, name)
    velocity, rates = (
        messages.read_vector(value.get(part), f"{name}.{part}")
        for part in ("linear_velocity", "angular_velocity")
    )
    return pose, velocity, rates


@method(
    "simSetKinematics",
    given(_read_kinematics, "state"),
    given(flag, "ignore_collision"),
    VEHICLE,
)
def _set_kinematics(
    simulation: Simulation, state: Any, ignore_collision: bool, vehicle: Vehicle
) -> None:
    vehicle.set_kinematics(*state)
    simulation.touch(vehicle)


_STRATOSPHERE = 11_000.0
"""Altitude in metres from which the temperature counts as constant."""


@vehicle_method("simGetGroundTruthEnvironment")
def _environment(vehicle: Vehicle) -> Map:
    altitude = vehicle.geo_point()["altitude"]
    kelvin = 288.15 - 0.0065 * min(altitude, _STRATOSPHERE)
    pressure = standard_pressure(altitude)
    return {
        "position": messages.vector(vehicle.pose.position),
        "geo_point": vehicle.geo_point(),
        "gravity": messages.vector((0.0, 0.0, 9.80665)),
        "air_pressure": pressure,
        "temperature": kelvin,
        "air_density": pressure / (287.05 * kelvin),
    }


def _read_place(value: Any, name: str) -> GeoPoint:
    return GeoPoint(*read_map(value, name, ("latitude", "longitude", "altitude")))


vehicle_method("simTestLineOfSightToPoint", given(_read_place, "point"))(Vehicle.sees)


@method(
    "simTestLineOfSightBetweenPoints", given(_read_place, "point1"), given(_read_place, "point2")
)
def _line_between(simulation: Simulation, place: GeoPoint, other: GeoPoint) -> bool:
    return simulation.find("").sees(place, other)


@method("getHomeGeoPoint", VEHICLE)
def _home_point(simulation: Simulation, vehicle: Vehicle) -> Map:
    return messages.geo_point(simulation.settings.home)
