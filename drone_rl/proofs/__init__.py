"""What a policy does from every placement of the cubes, proved in closed loop."""
