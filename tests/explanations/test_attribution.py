"""Heat maps of the film, and its key frames."""

import numpy as np
import torch

from drone_rl.explanations.attribution import FILMED, first_heat, key_frames, section, shown_methods
from drone_rl.explanations.rollouts import RolloutDataset
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.collect_cubes import CubesEnd


def test_the_film_has_the_steps_of_the_first_episode(context):
    found = section(context)
    steps = int((context.flights.episode == FILMED).sum())
    for heat in found.heat.values():
        assert set(np.unique(heat.reshape(steps, -1).max(1))) <= {0.0, 1.0}  # none, or a peak of 1
    assert len(found.frames) == len(found.heat_by) == steps
    assert found.actions.tolist() == context.flights.actions[:steps].tolist()
    assert np.allclose(found.probabilities.sum(-1), 1, atol=1e-3)


def test_the_default_method_is_grad_cam_or_the_first_available():
    every = ["occlusion", "saliency", "grad_cam_logit", "grad_cam"]
    assert shown_methods(every) == ["grad_cam", "grad_cam_logit"]
    assert shown_methods(["occlusion", "saliency"]) == ["saliency"]
    assert shown_methods(["occlusion"]) == ["occlusion"] and shown_methods([]) == []


def test_without_heat_the_next_method_is_taken():
    one, two = torch.zeros(3, 1, 2), torch.zeros(3, 1, 2)
    one[0, 0, 1], two[0], two[1, 0, 0] = 0.5, 7.0, 0.25
    heat, by = first_heat({"one": one, "two": two})
    assert heat.tolist() == [[[0.0, 0.5]], [[0.25, 0.0]], [[0.0, 0.0]]]
    assert by == ["one", "two", None]


def episode_of(length, collects=(), misses=(), end=CubesEnd.ALL_CUBES):
    event = np.zeros(length, np.int8)
    event[list(collects)], event[list(misses)] = 1, -1
    reason = np.zeros(length, int)
    reason[-1] = end
    arrays = {
        "event": event,
        "end_reason": reason,
        "episode": np.zeros(length, int),
    }
    return RolloutDataset(arrays)


def test_key_frames_of_a_successful_episode():
    frames = key_frames(episode_of(41, collects=(10, 20, 40)), 0, CollectCubes())
    assert [t for t, _ in frames] == [0, 5, 10, 20, 30, 40]
    assert [why for _, why in frames] == [
        "start", "approach", "collects a cube", "collects a cube", "in between", "collects a cube",
    ]  # fmt: skip


def test_key_frames_of_a_failed_episode():
    why = dict(
        key_frames(
            episode_of(30, collects=(9,), misses=(19,), end=CubesEnd.FRONT_BOUNDARY),
            0,
            CollectCubes(),
        )
    )
    assert why[19] == "misses a cube" and why[29] == "fails: front boundary" and len(why) == 6


def test_short_episodes_have_fewer_key_frames():
    assert [t for t, _ in key_frames(episode_of(3), 0, CollectCubes())] == [0, 1, 2]
