"""t-SNE of what the policy makes of its pictures, and of the raw pictures."""

import dataclasses
from typing import Any

from numpy.typing import NDArray

from drone_rl.explanations import tsne
from drone_rl.explanations.context import Context, LeftOutError
from drone_rl.explanations.threads import aside
from drone_rl.utils.seeding import legacy_seed


@aside
def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "tsne"; arrays "tsne_features" and "tsne_pixels" (T, 2)."""
    if context.layer is None:
        raise LeftOutError(
            "Frames are laid out by likeness of what a layer makes of them (t-SNE), and no layers "
            "of this policy are known; give it as a torch module made of layers."
        )
    data, settings = context.dataset, context.settings
    seed = legacy_seed(context.seed.value)
    numbers, arrays = {}, {}
    for name, originals in (
        ("features", data.features[context.layer]),
        ("pixels", data.observations),
    ):
        embedding = tsne.embed(originals, perplexity=settings.perplexity, seed=seed)
        arrays[f"tsne_{name}"] = embedding.points
        numbers[name] = {
            "layer": context.layer if name == "features" else None,
            "perplexity": settings.perplexity,
            **dataclasses.asdict(embedding.faithfulness),
        }
    return {"tsne": numbers}, arrays
