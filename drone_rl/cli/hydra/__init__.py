"""Hydra's side of the command line: schemas, composition, launchers, a sweeper, help."""
