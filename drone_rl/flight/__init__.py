"""Flight interfaces: AirSim's commands, Betaflight and MAVLink."""
