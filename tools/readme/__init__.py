"""`make readme`: the parts of README.md that are made from files, and whether they are of today.

python -m tools.readme           writes them
python -m tools.readme keep      takes the figures of outputs/bench over first
python -m tools.readme stale     tells which figures are older than the code that they measure
"""
