"""Third-party learners in the same environments with the same network, for comparison."""
