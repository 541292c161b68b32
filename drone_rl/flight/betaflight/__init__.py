"""Betaflight's firmware in the loop: build it, run it, exchange packets with it."""
