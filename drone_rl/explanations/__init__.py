"""Analyses of policies, checked against the simulator's ground truth.

`explain` makes an explanation: files with the results of all sections, and a report. A section is
a function of a `Context`; `report/` displays it.

Shared:

- `settings`, `explain`, `context`: settings, entry points, what sections share.
- `rollouts`, `scenes`, `hooks`: recorded episodes, rendered scenes, outputs of layers.
- `heat_maps`, `patches`, `trust`: attribution methods, the measured effects of patches with
  controls, and the tests of heat maps.

Sections: `behavior` (verdict, robustness, data set, contradictions, loops), `embedding` (t-SNE),
`class_models`, `attribution`, `truth`, `response` (maps over a target's place, asymmetry).
"""
