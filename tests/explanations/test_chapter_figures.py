"""Figures of the chapter, made again."""

import json

import numpy as np
import pytest

import drone_rl
from drone_rl.explanations.chapter_figures import _spread_by_side
from drone_rl.utils.errors import InputError


def test_three_states_have_the_exact_gradient():
    """Of three steps with probability 1/2 each: 0.75 * 3 * (1/2)^2 * (1/2) * (1/2)."""
    found = drone_rl.reproduce(3)
    assert found.numbers["exact_gradient"] == pytest.approx(0.75 * 3 / 16)
    error = abs(found.numbers["estimated_gradient"] - found.numbers["exact_gradient"])
    assert error < 2 * found.numbers["half_width95"]
    assert found.numbers["final_probability"] > 0.8


def test_embedding_counts_frames_and_actions(tmp_path):
    found = drone_rl.reproduce(7, frames=40, episodes=3)
    poor = found.numbers["poor"]
    assert (poor["frames"], poor["episodes"]) == (40, 3)
    assert poor["frames_by_action"] == {"forward": 0, "left": 40, "right": 0}
    assert found.numbers["right_and_forward"]["frames_by_action"]["left"] == 0
    found.save(tmp_path)
    written = json.loads((tmp_path / "figure_7.json").read_text())
    assert written["settings"]["figure"] == 7 and written["poor"] == poor
    assert (tmp_path / "figure_7.png").read_bytes().startswith(b"\x89PNG")
    assert str(found).startswith("Figure 7: t-SNE")


def test_embedding_may_be_tinted_by_sampled_actions():
    found = drone_rl.reproduce(8, frames=40, episodes=2, tint="sampled")
    assert sum(found.numbers["good"]["frames_by_action"].values()) == 40
    assert "sampled action" in found.caption


def test_class_models_have_the_chapters_settings():
    found = drone_rl.reproduce(12)
    assert set(found.numbers["probabilities"]) == {"left", "forward", "right"}


def test_attributions_show_cubes_to_both_sides():
    found = drone_rl.reproduce(15, frames=10**6)  # only of t-SNE and of the search for a pair
    assert len(found.numbers["frames"]) == 6 and "<img" in found._repr_html_()


def test_frames_are_spread_over_sides():
    aside = np.array([5.0, 5.0, 5.0, 0.0, 0.0, 0.0, -5.0, -5.0, -5.0, np.nan])
    chosen = aside[_spread_by_side(aside, 1.0)]
    assert sorted(chosen.tolist()) == [-5.0, -5.0, 0.0, 0.0, 5.0, 5.0]


@pytest.mark.parametrize("figure", [1, 2, 4, 16])
def test_figures_that_do_not_exist(figure):
    with pytest.raises(InputError, match=f"figure={figure} can't be reproduced; give one of 3, 7,"):
        drone_rl.reproduce(figure)


def test_more_frames_than_the_episodes_have():
    with pytest.raises(InputError, match=r"frames=999 is more than the \d+ of 1 episodes"):
        drone_rl.reproduce(8, frames=999, episodes=1)
