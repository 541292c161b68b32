"""Train, evaluate and audit vision policies of a drone, with pip alone."""

__version__ = "0.1.0"
