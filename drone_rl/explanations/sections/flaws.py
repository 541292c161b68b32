"""Alike pictures that are answered in opposite ways, and flights in loops."""

from typing import Any

from numpy.typing import NDArray

from drone_rl.explanations import contradictions, loops
from drone_rl.explanations.context import Context
from drone_rl.explanations.threads import aside


@aside
def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "contradictions", of the frames analysed, and "loops", of the whole flights."""
    data, flights = context.dataset, context.flights
    alike = contradictions.one_move(flights)
    scenes = context.scenes
    pairs = contradictions.find_pairs(data, alike, scenes.actions, data.offset(scenes.task))
    numbers = {
        "contradictions": contradictions.summarise_pairs(pairs, data, alike),
        "loops": loops.summarise_loops(flights, loops.find_loops(flights, scenes.actions)),
    }
    return numbers, {}
