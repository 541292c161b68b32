"""Explanations as something that a person opens and understands; reads files, runs no policy."""

from drone_rl.explanations.report.page import write_report

__all__ = ["write_report"]
