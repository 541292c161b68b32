"""Alike pictures that are answered in opposite ways, and flights in loops."""

import dataclasses
from typing import Any

from numpy.typing import NDArray

from drone_rl.explain import contradictions
from drone_rl.explain.context import Context


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "contradictions" and "loops"."""
    data = context.dataset
    pairs = contradictions.find_pairs(data)
    loops = contradictions.find_loops(data)
    numbers = {
        "contradictions": {
            **contradictions.summarise_pairs(pairs),
            "list": [dataclasses.asdict(pair) for pair in pairs],
        },
        "loops": {
            **contradictions.summarise_loops(data, loops),
            "list": [dataclasses.asdict(loop) for loop in loops],
        },
    }
    return numbers, {}
