"""Mutation testing: is there a test that notices when one token of the program changes?

`make mutants` lists the changes that Cosmic Ray (and a few operators of our own) can make to the
modules whose numbers are quoted, draws a fixed sample, runs each one's tests in a fork of a process
that has imported the libraries, and keeps what happened in docs/mutants.json. It works on a copy
of the tree; the tree itself is never changed.
"""
