"""The command line: what each command can be told, and which function of `drone_rl` does it."""
