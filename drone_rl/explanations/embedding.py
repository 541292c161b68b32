"""Section "embedding": t-SNE of the policy's features and of raw pixels (section 5.1)."""

import logging

import numpy as np
import openTSNE
from numpy.typing import NDArray
from sklearn.decomposition import PCA

from drone_rl.explanations.context import Context, image, needs
from drone_rl.explanations.results import Embedding, Faithfulness, Tsne
from drone_rl.explanations.settings import check_perplexity
from drone_rl.utils.errors import InputError
from drone_rl.utils.provenance import num_cores
from drone_rl.utils.seeding import legacy_seed

logging.getLogger("openTSNE").setLevel(logging.ERROR)  # its messages are not for users
COMPONENTS = 50  # principal components to which points are reduced first
NEIGHBOURS = 10  # neighbours by which faithfulness is measured
QUERIES = 1000  # most points whose neighbourhoods are compared
GAUSSIAN_DOF = 1e4
"""Degrees of freedom at which openTSNE's kernel (1 + d² / dof)^(-dof) is exp(-d²) within 1e-4."""
FEW = 2000  # up to so many points, exact neighbours and Barnes-Hut on one thread are fastest


def layers(context: Context) -> str | None:
    """Need a layer with features."""
    if context.layer is not None:
        return None
    return (
        "t-SNE needs the features of a layer, and no layers of this policy are known; give it as a "
        "torch module made of layers."
    )


@needs(layers, image)
def section(context: Context) -> Tsne:
    """Embed the analysed frames by the policy's features, and by their pixels."""
    layer = context.layer
    data, settings = context.dataset, context.settings
    originals = {"features": data.arrays[f"features/{layer}"], "pixels": data.observations}
    maps = {}
    for name, values in originals.items():
        points, measured = embed(
            values, perplexity=settings.perplexity, seed=legacy_seed(context.seed.value)
        )
        maps[name] = Embedding(
            layer=layer if name == "features" else None,
            perplexity=settings.perplexity,
            points=points,
            **measured.model_dump(),
        )
    return Tsne(**maps)


def embed(
    originals: NDArray, *, perplexity: float = 30.0, seed: int = 0, kernel: str = "student"
) -> tuple[NDArray, Faithfulness]:
    """Embed points (T, *) in the plane (Eqs. 16 and 17); return them (T, 2), and `faithfulness`.

    Args:
        originals: The points.
        perplexity: Effective number of neighbours.
        seed: Fixes the result; below 2**32.
        kernel: Similarity of points of the plane: "student", 1 / (1 + d²), as t-SNE is defined
            (van der Maaten and Hinton, 2008), or "gaussian", exp(-d²), as Eq. 17 prints it, which
            is symmetric SNE's.

    Raises:
        InputError: There are too few points for the perplexity, or one is not finite.
    """
    flat = originals.reshape(len(originals), -1).astype(np.float64)
    check_perplexity(perplexity, len(flat))
    if flat.shape[1] == 1:
        flat = flat.repeat(2, 1)  # openTSNE starts from two principal components
    if not np.isfinite(flat).all():
        raise InputError("features hold a value that is not finite; the policy's weights are bad")
    centred = flat - flat.mean(0)
    pca = PCA(min(COMPONENTS, *flat.shape), svd_solver="full")  # not a random one
    with np.errstate(invalid="ignore"):  # equal points have no variance
        reduced = pca.fit_transform(flat)
    few = len(flat) <= FEW
    model = openTSNE.TSNE(
        perplexity=perplexity,  # pyright: ignore[reportArgumentType] (takes fractions, too)
        initialization="pca",
        random_state=seed,
        n_jobs=1 if few else num_cores(),
        neighbors="exact" if few else "annoy",
        negative_gradient_method="bh" if few else "fft",
        dof=GAUSSIAN_DOF if kernel == "gaussian" else 1,  # pyright: ignore[reportArgumentType] (takes fractions, too)
    ).fit(_distinct(reduced, seed))
    points = np.array(model)
    return points, faithfulness(centred, points)


def faithfulness(originals: NDArray, points: NDArray, k: int = NEIGHBOURS) -> Faithfulness:
    """Measure how well an embedding (T, 2) keeps the neighbourhoods of originals (T, D).

    With ties, all points as near as the k-th count as nearest, also in the figure for chance.
    """
    count = len(originals)
    k = min(k, (count - 1) // 2)
    queries = np.unique(np.linspace(0, count - 1, min(count, QUERIES)).astype(int))
    true, drawn = _distances(originals, queries), _distances(points, queries)
    nearest = drawn.argsort(1, kind="stable")[:, 1 : k + 1]  # the query itself comes first
    ordered = np.sort(true, 1)
    reached = np.take_along_axis(true, nearest, 1)
    # 1 is the nearest; the query itself is nearer than all
    rank = np.stack([np.searchsorted(o, a) for o, a in zip(ordered, reached, strict=True)])
    strangers = np.maximum(rank - k, 0).sum()
    worst = len(queries) * k * (2 * count - 3 * k - 1) / 2
    as_near = (true <= ordered[:, [k]]).sum(1) - 1
    return Faithfulness(
        neighbours=k,
        trustworthiness=float(1 - strangers / worst),
        neighbours_kept=float((rank <= k).mean()),
        neighbours_chance=float(as_near.mean() / (count - 1)),
    )


def _distinct(points: NDArray, seed: int) -> NDArray:
    """Add tiny noise: identical points have no defined neighbourhood."""
    scale = max(points.std(), 1e-6) * 1e-6
    return points + np.random.default_rng(seed).normal(0, scale, points.shape)


def _distances(points: NDArray, queries: NDArray) -> NDArray:
    """Return squared distances of each query to all points; to itself -1. Shape: (queries, T).

    They are divided by their mean and rounded, so that equal distances are exactly equal.
    """
    centred = points - points.mean(0)
    square = (centred**2).sum(1)
    distance = square[queries, None] + square - 2 * centred[queries] @ centred.T
    distance = (distance / max(distance.mean(), 1e-300)).round(9)
    distance[np.arange(len(queries)), queries] = -1
    return distance
