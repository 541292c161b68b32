"""The world: what the drone and the cubes are, and the rules that hold between them."""
