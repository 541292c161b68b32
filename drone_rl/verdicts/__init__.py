"""Verdicts: what can be claimed of a policy, from episodes, certificates and measured domains."""
