"""The exception of a flight that a flight controller did not carry through."""


class LoopError(RuntimeError):
    """A flight controller stopped, fell silent or refused; the message says which, in one line."""


class NotBegunError(LoopError):
    """A flight controller did not get the drone to where a flight was to begin."""
