"""How the command line uses Hydra: defaults, composition, launchers, sweepers and messages."""
