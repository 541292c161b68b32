"""Strata of tasks of terms: bounds of bearing and distance, and the class of each goal."""

import math

import torch

from drone_rl.config.term_task import TermTaskSettings
from drone_rl.sim.tasks.strata import Strata, drawn


def strata(goal, **start):
    objects = {"goal": {"role": "goal", **goal}}
    terms = {"reward": {"reached": 1.0}, "success": ["all_goals"]}
    settings = {"objects": objects, "start": {"z": 2.0, **start}, **terms}
    return Strata(*drawn(TermTaskSettings.read(settings)))


def test_bearing_is_from_the_heading_and_distance_from_the_start():
    # ahead of a drone that looks to y, 5 to 15 m away
    found = strata({"x": 0.0, "y": [5.0, 15.0], "z": 2.0}, heading=90.0)
    assert found.degrees == 5.0 and 9.5 <= found.metres <= 10.5
    start = torch.tensor([[0.0, 0.0, 2.0, math.pi / 2], [1.0, 0.0, 2.0, 0.0]])
    places = torch.tensor([[0.0, 6.0, 2.0], [6.0, 6.0, 2.0], [-6.0, 12.0, 2.0], [0.5, 11.0, 2.0]])
    names = [*found.phrases]
    first, second = ([names[i] for i in row] for row in found.of(start, places.expand(2, 4, 3)))
    assert first == ["ahead_near", "right_near", "left_far", "ahead_far"]
    assert second == ["left_near", "left_near", "left_far", "left_far"]
    assert found.phrases["left_far"] == f"on its left over {found.metres:g} m away"
    assert (names[0], names[-1]) == ("left_far", "right_far")  # a verdict compares the outermost


def test_distances_that_hardly_differ_are_one_and_a_third_is_ahead():
    # y is uniform: a third is within 1 m of 6, atan(1 / 6) = 9.5 degrees
    found = strata({"x": 6.0, "y": [-3.0, 3.0], "z": 2.0})
    assert 9.0 <= found.degrees <= 10.0 and [*found.phrases] == ["left", "ahead", "right"]
    places = torch.tensor([[[6.0, 2.0, 2.0], [6.0, 0.5, 2.0], [6.0, -2.0, 2.0], [-6.0, -2.0, 2.0]]])
    assert found.of(torch.tensor([[0.0, 0.0, 2.0, 0.0]]), places).tolist() == [[0, 1, 2, 2]]
