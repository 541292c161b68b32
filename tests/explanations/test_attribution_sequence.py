import numpy as np

from drone_rl.explanations.attribution import key_frames
from drone_rl.explanations.rollouts import RolloutDataset
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.collect_cubes import EndReason


def fake(length, collects=(), misses=(), end=EndReason.ALL_CUBES):
    event = np.zeros(length, np.int8)
    event[list(collects)], event[list(misses)] = 1, -1
    reason = np.zeros(length, int)
    reason[-1] = end
    arrays = {
        "event": event,
        "end_reason": reason,
        "episode": np.zeros(length, int),
    }
    return RolloutDataset(arrays, {}, {})


def test_a_good_episode():
    frames = key_frames(fake(41, collects=(10, 20, 40)), 0, CollectCubes())
    assert [t for t, _ in frames] == [0, 5, 10, 20, 30, 40]
    assert [why for _, why in frames] == [
        "start", "approach", "collects a cube", "collects a cube", "in between", "collects a cube",
    ]  # fmt: skip


def test_a_failed_episode_shows_what_was_missed():
    why = dict(
        key_frames(
            fake(30, collects=(9,), misses=(19,), end=EndReason.FRONT_BOUNDARY), 0, CollectCubes()
        )
    )
    assert why[19] == "misses a cube" and why[29] == "fails: front boundary" and len(why) == 6


def test_short_episodes_have_fewer_frames():
    assert [t for t, _ in key_frames(fake(3), 0, CollectCubes())] == [0, 1, 2]
