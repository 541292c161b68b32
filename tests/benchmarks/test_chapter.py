"""Elements of the chapter that a command or test shows, and trainings of its algorithm."""

import dataclasses
import re
from pathlib import Path

import pytest

from benchmarks import chapter, original
from drone_rl.cli.commands import COMMANDS

ROOT = Path(__file__).parents[2]


def test_every_element_of_the_chapter_is_shown_by_a_command_or_test():
    """20 equations, 4 algorithms, 4 tables, 3 listings and 15 figures."""
    page = (ROOT / "docs" / "chapter.md").read_text()
    element = r"^\| (?:Eq\.|Algorithm|Table|Listing|Fig\.) \d+ \|(.*)\|$"
    rows = re.findall(element, page, re.MULTILINE)
    assert len(rows) == 46
    for row in rows:
        commands = re.findall(r"`drone-rl ([\w-]+)", row)
        tests = re.findall(r"`(tests/\S+\.py)`", row)
        assert commands or tests, row
        assert {*commands} <= {*COMMANDS} and all((ROOT / path).is_file() for path in tests), row


def test_minutes_are_scaled_to_all_episodes(tmp_path, monkeypatch):
    monkeypatch.setattr(chapter, "train", lambda run, *settings: (6.0, {}))
    assert chapter.minutes(tmp_path, 3000) == pytest.approx(1.0)


def test_the_best_training_solves_most_seeds_and_is_not_the_default(setup, monkeypatch):
    def train_seeds(folder, settings, seeds):
        for seed in seeds:
            (folder / str(seed)).mkdir(parents=True)
            rows = "\n".join(f"{i + 1},{i / 1000}" for i in range(1000))
            (folder / str(seed) / "metrics.csv").write_text(
                f"episodes,train/running_reward\n{rows}"
            )
        solved = {"default": 5, "constant 0.0001": 3, "step_decay 3e-05": 1}.get(folder.name, 0)
        return [{"solved": seed < solved, "verdict": "good"} for seed in seeds]

    monkeypatch.setattr(original, "train_seeds", train_seeds)
    figures = original.bench_original(dataclasses.replace(setup, quick=False))
    assert (figures["original_best"], figures["original_solved"]) == ("constant 0.0001", 3)
    assert figures["original_seeds"] == 5 and len(figures["original_runs"]) == 7
    assert (setup.folder / "original.png").stat().st_size > 10_000
