"""A simulated drone flown by an external flight controller (software or hardware in the loop)."""
