"""How the command line uses Hydra: schemas, composition, launchers, a sweeper and help."""
