"""A task of a user, from a file outside of the repository, with all commands."""
