"""What becomes of a command, over simulated time."""

from collections.abc import Callable

from drone_rl.flight.commands.command import Command


class FlightFuture:
    """A command that a drone has been told. Nothing happens to it unless simulated time passes."""

    def __init__(self, name: str, command: Command, wait: Callable[["FlightFuture"], None]) -> None:
        """Takes the command.

        Args:
            name: For people.
            command: What the drone is told.
            wait: Lets time pass until this is done.
        """
        self.name, self.command = name, command
        self.elapsed = 0.0
        """Simulated seconds since it was told."""
        self._wait = wait
        self._success: bool | None = None
        self._is_cancelled = False

    @property
    def done(self) -> bool:
        """Whether it is over, for good or ill."""
        return self._success is not None

    @property
    def cancelled(self) -> bool:
        """Whether another command took its place."""
        return self._is_cancelled

    def result(self) -> bool:
        """Lets time pass until it is done. Returns whether it did what was asked for, in time."""
        if not self.done:
            self._wait(self)
        return bool(self._success)

    def finish(self, success: bool) -> None:
        """Notes how it went."""
        self._success = success

    def cancel(self) -> None:
        """Notes that the drone no longer does it; what is done stays done."""
        if not self.done:
            self._is_cancelled, self._success = True, False

    def __repr__(self) -> str:
        """Returns its name and how it goes."""
        if self.cancelled:
            return f"<{self.name}: cancelled after {self.elapsed:.2f} s>"
        if not self.done:
            return f"<{self.name}: for {self.elapsed:.2f} s now>"
        return f"<{self.name}: {'done' if self._success else 'failed'} in {self.elapsed:.2f} s>"
