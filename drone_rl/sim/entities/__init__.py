"""What stands in a world, as dm_control entities, each with its meaning."""
