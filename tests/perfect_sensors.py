"""Sensors without noise."""

import dataclasses

from drone_rl.config.sensors import SensorSettings


def without_noise(settings):
    """The same without noise; rates, latencies, scales and the stated errors of GPS stay."""
    kinds = {field.name: getattr(settings, field.name) for field in dataclasses.fields(settings)}
    return SensorSettings(**{name: kind.replace(noise=0.0) for name, kind in kinds.items()})
