"""The sections of an explanation: each a function of the context, in a file of its own.

A section returns its numbers, by the keys of `explanation.json`, and its arrays, by those of
`arrays.npz`. It writes nothing, reads no other section's results, and may run at any time.
"""

from collections.abc import Callable, Mapping
from typing import Any

from numpy.typing import NDArray

from drone_rl.explain.context import Context
from drone_rl.explain.sections import (
    attribution,
    class_models,
    dataset,
    embedding,
    evaluation,
    flaws,
    response,
    truth,
)

Numbers = dict[str, Any]
Arrays = dict[str, NDArray]
Section = Callable[[Context], tuple[Numbers, Arrays]]

SECTIONS: Mapping[str, Section] = {
    "evaluation and verdict": evaluation.section,
    "data set": dataset.section,
    "t-SNE": embedding.section,
    "contradictions and loops": flaws.section,
    "class models": class_models.section,
    "attribution": attribution.section,
    "truth tests": truth.section,
    "response map": response.section,
}
"""All of them, by what people call them."""
