"""One drone flown by AirSim's commands (Tables 2 and 3) over simulated time."""
