"""The independent certificate checker: slow, simple, and without code of the prover."""
