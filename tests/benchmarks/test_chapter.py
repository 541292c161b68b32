"""Elements of the chapter, speed of the original algorithm, and networks with memory."""

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
        ("a | `b.py` | `drone-rl glide` | ", 0),
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


def test_all_figures_are_returned(tmp_path, monkeypatch):
    monkeypatch.setattr(chapter, "minutes", lambda folder, episodes: 7.0)
    monkeypatch.setattr(chapter, "speedup", lambda folder, times, root: 4.0)
    monkeypatch.setattr(chapter, "count_conventions", lambda root: 33)
    monkeypatch.setattr(chapter, "memory", lambda folder, quick, root: {"lstm_success": 0.9})
    found = chapter.bench_chapter(tmp_path, False)
    assert found["lstm_success"] == 0.9
    assert (found["original_minutes"], found["original_speedup"]) == (7.0, 4.0)
    assert found["convention_cases"] == 33


def test_minutes_are_scaled_to_all_episodes(tmp_path, monkeypatch):
    monkeypatch.setattr(chapter, "train", lambda run, *settings: (6.0, {}))
    assert chapter.minutes(tmp_path, 3000) == pytest.approx(1.0)


def test_networks_learn_the_same_task(tmp_path, monkeypatch):
    """Three trainings each; the median counts."""
    rates = iter([0.5, 1.0, 0.9, 0.4, 0.6, 0.5])
    given = []

    def train(run, *settings, environment):
        assert environment["PYTHONPATH"].startswith(f"{tmp_path}")
        given.append((run, settings))

    def call(name, policy, *args, environment):
        folder = given[-1][0] / "evaluation"
        folder.mkdir(parents=True)
        rate = next(rates)
        (folder / "evaluation.json").write_text(f'{{"greedy": {{"success": {{"share": {rate}}}}}}}')

    monkeypatch.setattr(chapter, "train", train)
    monkeypatch.setattr(chapter, "call", call)
    found = chapter.memory(tmp_path / "runs", False, root=tmp_path)
    assert found == {"lstm_success": 0.9, "memoryless_success": 0.5}
    networks = [settings[2] for _, settings in given]
    assert networks == ["network=lstm"] * 3 + ["network=small_cnn"] * 3
    assert [settings[3] for _, settings in given[:3]] == ["seed=0", "seed=1", "seed=2"]
