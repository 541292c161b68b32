"""Scenes from files: how fast they are drawn and learned, and what works on them."""
