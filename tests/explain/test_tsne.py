import numpy as np
import pytest

from drone_rl.explain import tsne
from drone_rl.utils.errors import InputError


@pytest.fixture(scope="module")
def clusters():
    rng = np.random.default_rng(0)
    centres = rng.normal(0, 10, (3, 20))
    return np.concatenate([c + rng.normal(0, 0.5, (40, 20)) for c in centres])


@pytest.fixture(scope="module")
def embedding(clusters):
    return tsne.embed(clusters, perplexity=10, seed=1)


def test_clusters_stay_together(embedding):
    groups = embedding.points.reshape(3, 40, 2)
    spread = max(group.std(0).max() for group in groups)
    centres = groups.mean(1)
    apart = min(np.linalg.norm(centres[i] - centres[j]) for i, j in ((0, 1), (0, 2), (1, 2)))
    assert apart > 3 * spread
    assert embedding.trustworthiness > 0.9
    assert embedding.neighbours_kept > 3 * embedding.neighbours_chance


def test_the_same_seed_gives_the_same_picture(clusters, embedding):
    again = tsne.embed(clusters, perplexity=10, seed=1)
    np.testing.assert_array_equal(again.points, embedding.points)


def test_new_points_go_to_their_cluster_and_move_nothing(clusters, embedding):
    before = embedding.points.copy()
    placed = embedding.place(clusters[:2] + 0.01)
    centres = embedding.points.reshape(3, 40, 2).mean(1)
    assert (np.linalg.norm(placed[:, None] - centres, axis=-1).argmin(1) == 0).all()
    np.testing.assert_array_equal(embedding.points, before)


def test_faithfulness_of_a_perfect_and_of_a_reversed_order():
    line = np.arange(9.0)[:, None]
    assert tsne.faithfulness(line, np.hstack([line, line]), k=2) == (1.0, 1.0)
    shuffled = line[[0, 5, 1, 6, 2, 7, 3, 8, 4]]
    trust, kept = tsne.faithfulness(line, np.hstack([shuffled, shuffled]), k=2)
    assert trust < 0.7 and kept < 0.4


def test_identical_points_are_no_error():
    assert np.isfinite(tsne.embed(np.zeros((30, 4)), perplexity=5).points).all()


def test_perplexity_that_does_not_fit_is_refused(clusters):
    with pytest.raises(InputError, match=r"perplexity=50 does not fit 120 points; give 1 to 39"):
        tsne.embed(clusters, perplexity=50)


def test_every_thumbnail_has_a_cell_of_its_own(embedding):
    cells = tsne.lay_out(embedding.points, columns=16, rows=10)
    assert len(np.unique(cells, axis=0)) == 120
    corner = tsne.lay_out(np.array([[0.0, 0.0], [1.0, 1.0]]), columns=3, rows=2)
    assert corner.tolist() == [[0, 0], [2, 1]]
