"""AirSim's interfaces: its settings file and its RPC server, for clients that were made for it."""
