"""Judge policies: rollouts, verdicts, robustness, operating domains, videos, export with a card."""
