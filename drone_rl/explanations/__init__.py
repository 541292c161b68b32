"""Analyses of policies, checked against the simulator's ground truth.

`explain` makes an explanation: files with the results of all sections, and a report. A section is
a function of a `Context`; `report/` displays it.
"""
