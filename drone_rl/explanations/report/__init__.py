"""Render explanations as an HTML report; reads files and runs no policy."""

from drone_rl.explanations.report.page import write_report

__all__ = ["write_report"]
