"""Recordings for Rerun, read back."""

import collections
import math
import sys

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config import (
    AppearanceSettings,
    TaskSettings,
)
from drone_rl.explanations.rerun_export import (
    EpisodeLog,
    _open,
    record,
    record_episode,
)
from drone_rl.policies.actor import exploring
from drone_rl.policies.baselines import ConstantAgent
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.utils.errors import InputError

rerun = pytest.importorskip("rerun", reason="rerun isn't installed: extra [rerun]")
RrdReader = rerun.chunk.RrdReader
TWO_AHEAD = TaskSettings(num_cubes=2, first_distance=4.0, spacing=4.0, lateral_bound=0.0)
"""Cubes at x = 4 and 8, straight ahead: a drone that moves a metre forward in each step touches
each at a distance of 1.65 m, so it collects them in steps 3 and 7, at x = 3 and 7."""
STEPS = 7
EVERY = list(range(STEPS + 1))


@pytest.fixture(autouse=True)
def _strict(monkeypatch):
    """Make Rerun raise what it would only warn about."""
    monkeypatch.setattr("rerun.error_utils._strict_mode", True)


def read(path):
    """Return values by entity, component and step; the step of static ones is None."""
    found = collections.defaultdict(lambda: collections.defaultdict(dict))
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        steps = [None] * len(batch) if chunk.is_static else batch["step"].to_pylist()
        for name in batch.schema.names:
            if ":" in name:
                for step, value in zip(steps, batch[name].to_pylist(), strict=True):
                    if value is not None:
                        found[chunk.entity_path][name][step] = value
    return found


def image_of(entity, step):
    """Return an image of a recording as an array."""
    size = entity["Image:format"][step][0]
    pixels = np.array(entity["Image:buffer"][step][0], np.uint8)
    return pixels.reshape(size["height"], size["width"], -1)


def network_of(actor):
    return actor.module[0].module


@pytest.fixture
def recorded(make_pipeline, tmp_path):
    """Record an episode of one environment; return what was written."""

    def make(actor=None, prepare=lambda network: None, **options):
        env, own = make_pipeline(1, **options)
        prepare(network_of(own))
        path = tmp_path / "episode.rrd"
        with _open(rerun, path, "test") as stream:
            log = EpisodeLog(rerun, stream, env)
            record_episode(env, actor or own, network_of(own), log)
        return read(path)

    return make


@pytest.fixture
def straight(recorded):
    """An episode straight on, through two cubes."""
    return recorded(ConstantAgent(0), task=TWO_AHEAD)


def test_timelines_are_steps_and_seconds(straight, tmp_path):
    names, seconds = set(), {}
    for chunk in RrdReader(tmp_path / "episode.rrd").stream():
        if not chunk.is_static:
            names |= set(chunk.timeline_names)
            batch = chunk.to_record_batch()
            times = (time.total_seconds() for time in batch["seconds"].to_pylist())
            seconds |= dict(zip(batch["step"].to_pylist(), times, strict=True))
    assert names == {"step", "seconds"}  # and no wall-clock time
    assert seconds == pytest.approx({step: 0.1 * step for step in EVERY})


def test_the_drone_and_its_path_are_where_they_were(straight):
    drone = straight["/world/drone"]
    for step in EVERY:
        assert drone["Transform3D:translation"][step] == [pytest.approx([step, 0.0, 2.5])]
        assert drone["Transform3D:quaternion"][step] == [[0.0, 0.0, 0.0, 1.0]]
        (path,) = straight["/world/trajectory"]["LineStrips3D:strips"][step]
        assert np.allclose(path, [[x, 0.0, 2.5] for x in range(step + 1)])
    assert drone["Boxes3D:half_sizes"][None] == [pytest.approx([0.4] * 3)]


@pytest.mark.parametrize(("name", "x", "step"), [("cube_0", 4.0, 3), ("cube_1", 8.0, 7)])
def test_a_cube_vanishes_when_it_is_collected(straight, name, x, step):
    cube = straight[f"/world/objects/{name}"]
    assert sorted(cube["Boxes3D:centers"]) == list(range(step))
    assert cube["Boxes3D:centers"][0] == [pytest.approx([x, 0.0, 2.5])]
    assert cube["Boxes3D:half_sizes"][0] == [pytest.approx([1.25] * 3)]
    assert cube["Boxes3D:class_ids"][0] == [SemanticClass.TARGET]
    assert sorted(cube["Clear:is_recursive"]) == list(range(step, STEPS + 1))


def test_rewards_are_at_the_step_that_they_lead_to(straight):
    rewards = straight["/reward/step"]["Scalars:scalars"]
    assert rewards == {step: [float(step in (3, 7))] for step in EVERY[1:]}
    earned = straight["/reward/return"]["Scalars:scalars"]
    assert [earned[step] for step in EVERY] == [[0.0]] * 3 + [[1.0]] * 4 + [[2.0]]
    assert straight["/end"]["TextLog:text"] == {7: ["end: all_cubes"]}


def test_the_camera_has_its_pose_on_the_drone_and_its_mounting(recorded):
    def camera(**look):
        settings = AppearanceSettings(**look)
        found = recorded(ConstantAgent(0), task=TWO_AHEAD, appearance=settings)
        found = found["/world/drone/camera"]
        x, y, z, w = found["Transform3D:quaternion"][0][0]
        forward = [-2 * (x * z + w * y), -2 * (y * z - w * x), -(1 - 2 * (x * x + y * y))]  # of -z
        lens = np.array(found["Pinhole:image_from_camera"][0][0]).reshape(3, 3).T
        return found["Transform3D:translation"][0][0], forward, lens

    place, forward, lens = camera()
    assert place == pytest.approx([0.4, 0.0, 0.0])
    assert forward == pytest.approx([1.0, 0.0, 0.0], abs=1e-6)
    focal = 32 / math.tan(math.radians(135 / 2))  # half of 64 columns show half of 135 degrees
    assert np.allclose(lens, [[focal, 0, 32], [0, focal, 12.5], [0, 0, 1]], atol=1e-3)
    turn = (0.0, 0.0, 90.0)
    place, forward, lens = camera(
        camera_offset=(0.0, 0.5, 0.0), camera_turn=turn, camera_widening=-45.0
    )
    assert place == pytest.approx([0.4, 0.5, 0.0])
    assert forward == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)  # to the left
    assert lens[0, 0] == pytest.approx(32.0)  # 90 degrees


def test_heat_maps_are_laid_over_observations(recorded):
    def sharpen(network):
        with torch.no_grad():  # a policy with opinions, or every map would be nearly flat
            network.layers.logits.weight.mul_(300)

    found = recorded(ConstantAgent(0), sharpen, task=TWO_AHEAD)
    methods = found["/heat_map/method"]["TextLog:text"]
    allowed = {"heat map: grad_cam", "heat map: grad_cam_logit"}
    assert methods and {text for (text,) in methods.values()} <= allowed
    for step in range(STEPS):
        observation, heat = (image_of(found[name], step) for name in ("/observation", "/heat_map"))
        assert observation.shape == heat.shape == (25, 64, 3)
        is_colored = (heat.max(-1) != heat.min(-1)).any()
        assert is_colored == (step in methods)
    assert found["/heat_map"]["Clear:is_recursive"] == {STEPS: [False]}  # no action, no map


def test_a_recording_has_the_episodes_of_the_policy(tmp_path):
    policy = drone_rl.load_policy("good").in_task(num_cubes=1, first_distance=4.0)
    files = record(policy, tmp_path / "new", 2, greedy=False, seed=3)
    assert [file.name for file in files] == ["episode_0.rrd", "episode_1.rrd"]
    with policy.flying(1, seed=3) as (env, actor), torch.no_grad():
        for file in files:
            found, state, step = read(file), env.reset(), 0
            chances = found["/action/probabilities"]["Scalars:scalars"]
            while not state["done"].all():
                with exploring(greedy=False):
                    acted = actor(state.clone(False))
                assert chances[step] == pytest.approx(acted["logits"][0].softmax(-1).tolist())
                name = ["forward", "left", "right"][int(acted["action"][0])]
                assert found["/action/taken"]["TextLog:text"][step] == [name]
                state = env.step(state.set("action", acted["action"]))["next"]
                step += 1
            assert sorted(chances) == list(range(step))


def test_mistakes(tmp_path, monkeypatch):
    policy = drone_rl.load_policy("good")
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"episode_0\.rrd can't be written .* another folder"):
        record(policy, tmp_path / "file", 1)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(InputError, match=r"format=rerun needs rerun, .* -e '\.\[rerun\]'"):
        record(policy, tmp_path, 1)
