"""t-SNE and its measures of faithfulness."""

from types import SimpleNamespace

import numpy as np
import pytest
from openTSNE.affinity import PerplexityBasedNN

from drone_rl.explanations.context import find_lacking
from drone_rl.explanations.embedding import embed, faithfulness, section
from drone_rl.explanations.rollouts import RolloutDataset
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.utils.errors import InputError


def test_features_and_pixels_are_embedded():
    rng = np.random.default_rng(0)
    shapes = {"features/fc1": (40, 8), "observations": (40, 1, 3, 4)}
    data = RolloutDataset({n: rng.normal(size=s).astype(np.float32) for n, s in shapes.items()})
    settings = ExplainSettings(frames=40, perplexity=4, seed=1)
    seed = SimpleNamespace(value=settings.seed)
    found = section(SimpleNamespace(dataset=data, settings=settings, seed=seed, layer="fc1"))
    assert found.features.points.shape == found.pixels.points.shape == (40, 2)
    assert (found.features.layer, found.pixels.layer) == ("fc1", None)
    assert 0 < found.pixels.trustworthiness <= 1
    assert found.features.neighbours_kept > found.features.neighbours_chance


def test_without_layers_it_is_left_out():
    lacking = find_lacking({"tsne": section}, SimpleNamespace(layer=None))
    assert "no layers of this policy are known; give it as a torch" in lacking["tsne"]


@pytest.fixture(scope="module")
def clusters():
    rng = np.random.default_rng(0)
    centres = rng.normal(0, 10, (3, 20))
    return np.concatenate([c + rng.normal(0, 0.5, (40, 20)) for c in centres])


@pytest.fixture(scope="module")
def embedding(clusters):
    return embed(clusters, perplexity=10, seed=1)


def test_clusters_stay_together(embedding):
    groups = embedding[0].reshape(3, 40, 2)
    spread = max(group.std(0).max() for group in groups)
    centres = groups.mean(1)
    apart = min(np.linalg.norm(centres[i] - centres[j]) for i, j in ((0, 1), (0, 2), (1, 2)))
    assert apart > 3 * spread
    faithful = embedding[1]
    assert faithful.trustworthiness > 0.9
    assert faithful.neighbours_kept > 3 * faithful.neighbours_chance
    assert faithful.neighbours_chance == pytest.approx(10 / 119)


@pytest.mark.parametrize(("kernel", "other"), [("gaussian", "student"), ("student", "gaussian")])
def test_each_kernel_ends_where_its_own_gradient_vanishes(kernel, other):
    """The gradient of KL(P, Q), by Eq. 17's exp(-d²) and by t-SNE's 1 / (1 + d²)."""
    rng = np.random.default_rng(0)
    originals = rng.normal(size=(60, 4))
    p = PerplexityBasedNN(originals, perplexity=10, method="exact").P.toarray()
    points = embed(originals, perplexity=10, seed=1, kernel=kernel)[0]

    def gradient(name):
        offsets = points[:, None] - points[None]
        squares = (offsets**2).sum(-1)
        similar = np.exp(-squares) if name == "gaussian" else 1 / (1 + squares)
        np.fill_diagonal(similar, 0.0)
        pull = similar if name == "student" else 1.0
        forces = (p - similar / similar.sum()) * pull
        return np.abs((forces[..., None] * offsets).sum(1)).max()

    assert gradient(kernel) < 0.1 * gradient(other)


def test_faithfulness_by_hand():
    """Points 0 1 3 7 15 are drawn at 0 10 1 13 15; k = 2, so every rank beyond 2 is a stranger's.

    Ranks of the two drawn nearest: of 0, those of 3 and 1 (2, 1); of 1, those of 7 and 15 (3, 4);
    of 3, those of 0 and 1 (2, 1); of 7, those of 15 and 1 (4, 2); of 15, those of 7 and 1 (1, 3).
    (From 3, 0 and 1 and 7 are 3, 2 and 4 away; from 7, 3 is 4, 1 is 6, 0 is 7, 15 is 8 away.)
    """
    line = np.array([0.0, 1, 3, 7, 15])[:, None]
    drawn = np.array([0.0, 10, 1, 13, 15])[:, None] * (1, 0)
    found = faithfulness(line, drawn, k=2)
    assert found.neighbours == 2 and found.neighbours_chance == pytest.approx(2 / 4)
    assert found.neighbours_kept == pytest.approx(6 / 10)
    # beyond 2: 1 + 2 of point 1, 2 of point 7, 1 of point 15; at worst 5 * 2 * (10 - 6 - 1) / 2
    assert found.trustworthiness == pytest.approx(1 - 6 / 15)


def test_equal_points_are_all_neighbours():
    """A dead layer: whatever is drawn is faithful, and so is a random placement."""
    rng = np.random.default_rng(0)
    found = faithfulness(np.full((50, 7), 0.1), rng.normal(size=(50, 2)))
    assert (found.trustworthiness, found.neighbours_kept, found.neighbours_chance) == (
        1,
        1,
        1,
    )


def test_features_that_are_not_finite_are_refused():
    with pytest.raises(InputError, match="not finite"):
        embed(np.full((40, 3), np.nan), perplexity=5)


def test_perplexity_that_does_not_fit_is_refused(clusters):
    with pytest.raises(InputError, match=r"perplexity=50 does not fit 120 points; give 1 to 39"):
        embed(clusters, perplexity=50)


def test_features_of_one_dimension_are_embedded():
    points, found = embed(np.linspace(0.0, 1.0, 40)[:, None], perplexity=5)
    assert points.shape == (40, 2)
    assert found.neighbours_kept > 2 * found.neighbours_chance
