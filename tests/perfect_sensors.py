"""Sensors without noise."""

from drone_rl.config.sensors import SensorSettings


def without_noise(settings):
    """The same without noise; rates, latencies, scales and the stated errors of GPS stay."""
    return SensorSettings(**{name: kind.replace(noise=0.0) for name, kind in settings})
