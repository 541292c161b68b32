"""What a policy sees, and whether to trust it: measures checked against the simulator's truth."""
