"""What a policy does, said exactly and not estimated from flights."""
