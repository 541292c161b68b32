"""The one exception that means "the user asked for something impossible"."""


class InputError(ValueError):
    """A mistake in what the user gave: a setting, a file, a device.

    The message is one line that names the value received and the remedy. The command line prints
    it without a traceback and exits with a non-zero status; any other exception is a bug of ours.
    """
