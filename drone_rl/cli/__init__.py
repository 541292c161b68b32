"""The command line: the settings of each command and the function of `drone_rl` that it calls."""
