"""Figures of policies with several inputs."""
