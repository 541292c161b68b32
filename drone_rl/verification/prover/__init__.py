"""The prover: exact statements about a policy over all placements of the cubes."""
