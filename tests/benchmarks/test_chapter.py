"""Elements of the chapter, rates of the original algorithm, and cases of conventions."""

import pytest

from benchmarks import chapter


def test_every_element_of_the_chapter_is_listed_and_shown():
    """20 equations, 4 algorithms, 4 tables, 3 listings and 15 figures."""
    root = chapter._ROOT
    assert chapter.count_elements(root / "docs" / "chapter.md", root) == (46, 46)


@pytest.mark.parametrize(
    ("cells", "shown"),
    [
        ("a | `b.py` | `drone-rl train seed=1` | ", 1),
        ("a | `b.py` | `drone-rl fly` | ", 0),
        ("a | `b.py` | `tests/here.py` | ", 1),
        ("a | `b.py` | `tests/gone.py` | ", 0),
        ("a | `b.py` | nothing | ", 0),
    ],
)
def test_an_element_is_shown_by_a_command_or_test_that_exists(tmp_path, cells, shown):
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "here.py").touch()
    page = tmp_path / "page.md"
    page.write_text(f"| element | what |\n| --- | --- |\n| Eq. 1 | {cells}|\n| other | x |\n")
    assert chapter.count_elements(page, tmp_path) == (1, shown)


def test_the_best_rate_solves_most_seeds(tmp_path, monkeypatch):
    def train_rate(folder, rate, seeds, quick):
        return [{"solved": rate == 1e-4 and seed < 3} for seed in seeds]

    monkeypatch.setattr(chapter, "train_rate", train_rate)
    monkeypatch.setattr(chapter, "minutes", lambda folder, episodes: 7.0)
    monkeypatch.setattr(chapter, "speedup", lambda folder, times, root: 4.0)
    monkeypatch.setattr(chapter, "count_conventions", lambda root: 33)
    found = chapter.bench_chapter(tmp_path, False)
    assert (found["original_rate"], found["original_solved"]) == (1e-4, 3)
    assert (found["original_minutes"], found["original_speedup"]) == (7.0, 4.0)


def test_runs_are_trained_and_judged(tmp_path, monkeypatch):
    calls = []

    def train(run, *settings):
        calls.append(settings)
        run.mkdir(parents=True)
        return 2.5, {"reason": "solved", "episodes": 20, "frames": 600}

    def call(name, *args, statuses):
        (tmp_path / "0" / "verdict").mkdir()
        (tmp_path / "0" / "verdict" / "verdict.json").write_text(
            '{"kind": "good", "certain": false}'
        )

    monkeypatch.setattr(chapter, "train", train)
    monkeypatch.setattr(chapter, "call", call)
    (found,) = chapter.train_rate(tmp_path, 1e-4, [0], quick=True)
    assert found["solved"] and found["verdict"] == "good (not certain)"
    assert "optimizer.lr=0.0001" in calls[0] and "trainer.total_episodes=20" in calls[0]


def test_minutes_are_scaled_to_all_episodes(tmp_path, monkeypatch):
    monkeypatch.setattr(chapter, "train", lambda run, *settings: (6.0, {}))
    assert chapter.minutes(tmp_path, 3000) == pytest.approx(1.0)
