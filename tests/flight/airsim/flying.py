"""Vehicles without a scene, flown without a server."""

import torch

from drone_rl.config import DynamicsSettings
from drone_rl.flight.airsim.settings_file import VehicleChoice
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.sim.coordinates import HOME
from drone_rl.sim.dynamics import Obstacles

BOX = Obstacles(torch.tensor([[[5.0, 0.0, 1.0]]], dtype=torch.float64), (1.0, 1.0, 1.0))


def make(kind="SimpleFlight", obstacles=None, home=HOME, **choice):
    given = VehicleChoice(vehicle_type=kind, **{"has_api_control": True, **choice})
    dynamics = DynamicsSettings(mode="simple_flight")
    around = {"obstacles": obstacles, "names": ["box"]}
    height = dynamics.radius if kind == "SimpleFlight" else 2.5
    return Vehicle("A", given, dynamics, None, **around, home=home, height=height)


def fly(vehicle, future, seconds=60.0):
    ticks = round(seconds / vehicle.settings.tick)
    while not future.done and ticks > 0:
        vehicle.run(vehicle.period)
        ticks -= vehicle.period
    return future.result() if future.done else None
