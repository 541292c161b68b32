"""Renderers by name."""

import importlib

from drone_rl.config.camera import RENDERERS
from drone_rl.sim.rendering.renderer import MakeRenderer
from drone_rl.utils.errors import InputError


def find_renderer(which: str | MakeRenderer) -> MakeRenderer:
    """What makes a renderer.

    Args:
        which: Its name, see `RENDERERS`, or what makes it itself.

    Raises:
        InputError: There is none of that name.
    """
    if not isinstance(which, str):
        return which
    if which not in RENDERERS:
        raise InputError(f"renderer={which!r} is unknown; give one of: {', '.join(RENDERERS)}")
    module, _, name = RENDERERS[which].rpartition(".")
    return getattr(importlib.import_module(module), name)
