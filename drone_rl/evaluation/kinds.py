"""What a policy can be called, and the exit statuses that say so.

Plain Python, for all who read verdicts from files.
"""

import enum

NOT_CERTAIN = 13
"""Exit status where the episodes are too few to be certain of the kind."""
NOT_PROVED = 16
"""Exit status where a proof for every placement is required, and no certificate gives it."""

NOT_COVERED = 17
"""Exit status where conditions are required in which the policy was not found to be good."""


_TRIVIAL_CODE = 18


class Kind(enum.StrEnum):
    """What a policy is."""

    GOOD = "good"
    TRIVIAL = "good, but trivial"
    """It succeeds as a good policy does, and so does a baseline that ignores the observations."""
    POOR = "poor"
    ONE_SIDED_LEFT = "one-sided (left)"
    ONE_SIDED_RIGHT = "one-sided (right)"
    NONE = "none of these"

    @property
    def exit_code(self) -> int:
        """0 for good; 10 poor, 11 one-sided, 12 none of these, 18 good, but trivial."""
        codes = {Kind.GOOD: 0, Kind.POOR: 10, Kind.NONE: 12, Kind.TRIVIAL: _TRIVIAL_CODE}
        return codes.get(self, 11)

    @property
    def mirrored(self) -> "Kind":
        """What it is in a world where left is right."""
        left, right = Kind.ONE_SIDED_LEFT, Kind.ONE_SIDED_RIGHT
        return {left: right, right: left}.get(self, self)

    @property
    def family(self) -> str:
        """One of `KINDS`."""
        return "one-sided" if self.exit_code == Kind.ONE_SIDED_LEFT.exit_code else self.value


KINDS = ("good", "good, but trivial", "one-sided", "poor", "none of these")
"""Families of kinds, best first, for those to whom the side doesn't matter."""
