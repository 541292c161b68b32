"""`make readme`: what README.md and docs/ have that is made from files, and whether it is of today.

python -m tools.readme           writes it
python -m tools.readme keep      takes the figures of outputs/bench over first
python -m tools.readme stale     tells which figures are older than the code that they measure
"""
