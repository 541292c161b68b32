"""The independent checker of certificates: slow, plain, and without any code of the prover."""
