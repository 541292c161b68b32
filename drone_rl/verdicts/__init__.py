"""Verdicts on policies from episodes, certificates and operating domains; export with a card."""
