"""Mutation testing: measure whether the tests detect the change of one token.

`make mutants` lists the mutations of the package by Cosmic Ray and by two operators of our own, and
samples 1,000 of them with a fixed seed. For each mutant it runs the tests that execute the mutated
block, according to recorded coverage, in a fork of a process that has imported the libraries. It
writes the outcomes to docs/mutants.json. It mutates a copy of the tree, never the tree itself.

Warp kernels are mutated too, in proportion to their size, and compiled again for each mutant at
optimization level 1, which gives the same results.
"""
