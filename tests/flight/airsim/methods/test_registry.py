"""Calls by name: counts of arguments, unknown methods, and methods that the server lacks."""

import pytest

from drone_rl.flight.airsim.methods import METHODS, UnknownMethodError, call, suggestion
from drone_rl.flight.airsim.settings_file import parse_settings
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.utils.errors import InputError


@pytest.fixture(scope="module")
def simulation():
    found = Simulation(parse_settings('{"Vehicles": {"A": {}, "B": {}}}'), "empty")
    yield found
    found.close()


def test_all_features_are_registered():
    one_of_each = {"ping", "takeoff", "getMultirotorState", "simGetImages", "simGetCameraInfo"}
    assert one_of_each | {"simSpawnObject", "simPlotPoints"} <= METHODS.keys()
    assert len(METHODS) > 90


def test_missing_arguments_are_an_error_and_more_are_ignored(simulation):
    with pytest.raises(InputError, match="moveToZ was called with 1 arguments; give 2 or more"):
        call(simulation, "moveToZ", [1.0])
    assert call(simulation, "ping", [1, 2, 3]) is True


def test_vehicles_are_named_by_text_or_bytes(simulation):
    assert call(simulation, "isApiControlEnabled", ["B"]) is False
    assert call(simulation, "isApiControlEnabled", [b"B"]) is False
    assert call(simulation, "isApiControlEnabled", []) is False
    with pytest.raises(InputError, match="Vehicle API for 'C' is not available"):
        call(simulation, "isApiControlEnabled", ["C"])
    with pytest.raises(InputError, match="Vehicle Sim-API for 'C' is not available"):
        call(simulation, "simGetVehiclePose", ["C"])
    with pytest.raises(InputError, match="vehicle_name=7 is not a text"):
        call(simulation, "isApiControlEnabled", [7])


def test_unknown_methods_have_a_suggestion(simulation):
    with pytest.raises(UnknownMethodError):
        call(simulation, "takeof", [])
    assert "takeoff" in suggestion("takeof")
    with pytest.raises(InputError, match="getCarState is not supported: this server has no cars"):
        call(simulation, "getCarState", [])
