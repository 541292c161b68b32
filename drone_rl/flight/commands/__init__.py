"""One drone, flown as its pilot would: AirSim's commands (Tables 2 and 3) over simulated time."""
