"""What a drone refuses to do in the state that it is in."""

from drone_rl.utils.errors import InputError


class PilotError(InputError):
    """A command at a moment when no real drone would obey it, such as taking off unarmed.

    The message is one line that says why, and what to do first.
    """
