"""Mutation testing: is there a test that notices when one token of the program changes?

`make mutants` lists the changes that Cosmic Ray (and a few operators of our own) can make to the
whole package but its benchmarks and samples 1,000 of them with a fixed seed. For each it runs the
tests that execute the changed block, as a recorded run of all tests has shown, in a fork of a
process that has imported the libraries, and keeps what happened in docs/mutants.json. It works on
a copy of the tree; the tree itself is never changed.

Whatever Warp compiles is mutated too, in proportion to its size, and compiled again for each
mutant, at optimization level 1, where results are the same.
"""
