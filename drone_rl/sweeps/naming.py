"""The folder of a sweep follows from its command, so that the same command finds it again."""

import hashlib
import re
from collections.abc import Sequence

_ELSEWHERE = ("hydra.", "hydra/", "paths.", "+hydra", "-")
"""Beginnings of what says where and how a sweep runs, not what it is."""


def is_sweep(overrides: Sequence[str]) -> bool:
    """Whether a command line asks for many runs."""
    flags = {"-m", "--multirun", "hydra.mode=MULTIRUN"}
    alone = "hydra.mode=RUN" in overrides
    return not alone and any(o in flags or o.startswith("sweep=") for o in overrides)


def sweep_name(overrides: Sequence[str]) -> str:
    """A name that two commands share if and only if they ask for the same runs.

    It tells the file in conf/sweep, or else the settings that are swept, and a hash of the rest.
    """
    what = sorted(o for o in overrides if not o.startswith(_ELSEWHERE))
    files = [o.partition("=")[2] for o in what if o.startswith("sweep=")]
    keys = [o.partition("=")[0] for o in what if "," in o or "range(" in o]
    label = re.sub(r"[^\w.-]+", "-", "+".join(files or keys))[:60]
    digest = hashlib.sha256("\n".join(what).encode()).hexdigest()[:8]
    return f"{label}-{digest}" if label else digest
