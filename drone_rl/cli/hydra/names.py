"""Names that settings had: `checkpoint=` for a policy, `policy=` for the network of a training."""

import re
from collections.abc import Sequence


def policies(overrides: Sequence[str]) -> list[str]:
    """Lets `checkpoint=good` say `policy=good`, in commands whose policy is trained already."""
    return [re.sub(r"^checkpoint=", "policy=", override) for override in overrides]


def former(overrides: Sequence[str]) -> list[str]:
    """What `networks` was given, in the words of old."""
    return [re.sub(r"^(\+{0,2}|~)network(?=[.=])", r"\1policy", o) for o in overrides]


def networks(overrides: Sequence[str]) -> list[str]:
    """Lets `policy=mlp` and `policy.hidden=[64]` say `network=mlp` and so on, in trainings."""
    return [re.sub(r"^(\+{0,2}|~)policy(?=[.=])", r"\1network", o) for o in overrides]
