"""How the command line uses Hydra: schemas, composition, launchers, sweepers, mistakes and help."""
