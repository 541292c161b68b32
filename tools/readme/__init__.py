"""`make readme`: generate the tables of README.md and docs/.

python -m tools.readme           write the generated blocks
python -m tools.readme keep      copy the figures of outputs/bench to docs/results.json first
python -m tools.readme stale     list the figures that are older than the code that they measure
"""
