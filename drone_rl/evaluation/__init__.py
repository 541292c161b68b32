"""Evaluate policies: rollouts, metrics, baselines, verdicts, videos."""
