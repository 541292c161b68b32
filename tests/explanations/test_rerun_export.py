"""Recordings, read back: an episode whose every step is known, and those of trained policies."""

import collections
import contextlib
import io
import math
import sys

import numpy as np
import pytest
import torch
from PIL import Image

import drone_rl
from drone_rl.config import (
    ActionSettings,
    AppearanceSettings,
    DynamicsSettings,
    PillarsSettings,
    TaskSettings,
)
from drone_rl.config.networks import Lstm
from drone_rl.config.training import TrainSettings
from drone_rl.explanations.heat_maps import Explainer
from drone_rl.explanations.rerun_export import (
    CLASS_COLORS,
    EpisodeLog,
    _open,
    record,
    record_episode,
)
from drone_rl.policies import make_actor
from drone_rl.policies.actor import exploring
from drone_rl.policies.baselines import constant_policy
from drone_rl.policies.zoo import describe
from drone_rl.sim.composer_task import CONTROL_TIMESTEP_S, seconds_per_step
from drone_rl.sim.dynamics import ComputerVision, Kinematic, Quadrotor
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.trust.plots.images import heated, shown_picture
from drone_rl.trust.video import CAMERAS, render_step
from drone_rl.utils.errors import InputError
from tests.second_task import Posts

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
    return recorded(constant_policy(0), task=TWO_AHEAD)


def test_all_is_on_one_timeline_of_steps_and_seconds(straight, tmp_path):
    names, seconds = set(), {}
    for chunk in RrdReader(tmp_path / "episode.rrd").stream():
        if not chunk.is_static:
            names |= set(chunk.timeline_names)
            batch = chunk.to_record_batch()
            times = (time.total_seconds() for time in batch["seconds"].to_pylist())
            seconds |= dict(zip(batch["step"].to_pylist(), times, strict=True))
    assert names == {"step", "seconds"}  # and no wall-clock time
    assert seconds == pytest.approx({step: 0.1 * step for step in EVERY})


def test_entities_have_a_value_at_each_step(straight):
    states = {
        "/world/drone": "Transform3D:translation",
        "/world/trajectory": "LineStrips3D:strips",
        "/world/camera": "Image:buffer",
        "/segmentation": "SegmentationImage:buffer",
        "/observation": "Image:buffer",
        "/reward/return": "Scalars:scalars",
        **{f"/cameras/{name}": "EncodedImage:blob" for name in ("chase", *CAMERAS)},
    }
    actions = {
        "/action/probabilities": "Scalars:scalars",
        "/action/taken": "TextLog:text",
        "/heat_map": "Image:buffer",
    }
    for path, component in states.items():
        assert sorted(straight[path][component]) == EVERY, path
    for path, component in actions.items():
        assert sorted(straight[path][component]) == EVERY[:-1], path
    others = {
        "/world/objects/cube_0",
        "/world/objects/cube_1",
        "/reward/step",
        "/end",
        "/world",
        "/",
    }
    optional = {"/heat_map/method", "/__properties", "/__properties/recording"}
    assert set(straight) - optional == {*states, *actions, *others}


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
    assert cube["Boxes3D:centers"] == {0: [pytest.approx([x, 0.0, 2.5])]}
    assert cube["Boxes3D:half_sizes"] == {0: [pytest.approx([1.25] * 3)]}
    assert cube["Boxes3D:class_ids"] == {0: [SemanticClass.TARGET]}
    assert cube["Clear:is_recursive"] == {step: [False]}


def test_rewards_are_at_the_step_that_they_lead_to(straight):
    rewards = straight["/reward/step"]["Scalars:scalars"]
    assert rewards == {step: [float(step in (3, 7))] for step in EVERY[1:]}
    earned = straight["/reward/return"]["Scalars:scalars"]
    assert [earned[step] for step in EVERY] == [[0.0]] * 3 + [[1.0]] * 4 + [[2.0]]
    assert straight["/end"]["TextLog:text"] == {7: ["end: all_cubes"]}


def test_actions_have_names_and_an_actor_without_logits_is_certain(straight):
    chances = straight["/action/probabilities"]
    assert all(chances["Scalars:scalars"][step] == [1.0, 0.0, 0.0] for step in EVERY[:-1])
    assert chances["SeriesLines:names"][None] == ["forward", "left", "right"]
    assert set(map(tuple, straight["/action/taken"]["TextLog:text"].values())) == {("forward",)}


def test_segmentation_has_named_classes(straight):
    shown = np.array(straight["/segmentation"]["SegmentationImage:buffer"][0][0], np.uint8)
    shown = shown.reshape(25, 64)
    assert (shown[0] == SemanticClass.SKY).all() and (shown[-1] == SemanticClass.GROUND).all()
    assert (shown[12, 31:33] == SemanticClass.TARGET).all()
    assert set(np.unique(shown)) == {0, 1, 2}
    (context,) = straight["/"]["AnnotationContext:context"][None]
    labels = {entry["class_id"]: entry["class_description"]["info"]["label"] for entry in context}
    assert labels == {kind.value: kind.name.lower() for kind in SemanticClass}
    assert set(CLASS_COLORS) == set(SemanticClass)


def test_the_policys_camera_is_on_the_drone_and_projects_as_it_renders(straight):
    camera = straight["/world/camera"]
    for step in EVERY:
        assert camera["Transform3D:translation"][step] == [pytest.approx([step + 0.4, 0.0, 2.5])]
    x, y, z, w = camera["Transform3D:quaternion"][0][0]
    forward = [-2 * (x * z + w * y), -2 * (y * z - w * x), -(1 - 2 * (x * x + y * y))]  # of -z
    assert forward == pytest.approx([1.0, 0.0, 0.0], abs=1e-6)
    focal = 32 / math.tan(math.radians(135 / 2))  # half of 64 columns show half of 135 degrees
    lens = np.array(camera["Pinhole:image_from_camera"][0][0]).reshape(3, 3).T
    assert np.allclose(lens, [[focal, 0, 32], [0, focal, 12.5], [0, 0, 1]], atol=1e-3)
    assert camera["Pinhole:resolution"][0] == [[64.0, 25.0]]


def test_images_are_those_that_the_film_shows(straight, make_pipeline):
    env, _ = make_pipeline(1, task=TWO_AHEAD)
    env.reset()
    seen = render_step(env.base_env)
    assert np.array_equal(image_of(straight["/world/camera"], 0), seen.camera)
    for name, pixels in zip(("chase", *CAMERAS), (seen.chase, *seen.strip), strict=True):
        (encoded,) = straight[f"/cameras/{name}"]["EncodedImage:blob"][0]
        shown = np.asarray(Image.open(io.BytesIO(bytes(encoded))), np.float64)
        assert np.abs(shown - pixels.numpy()).mean() < 2, name  # of 255 levels: it is a JPEG


def test_a_cameras_mounting_is_recorded(recorded):
    look = AppearanceSettings(
        camera_offset=(0.0, 0.5, 0.0), camera_turn=(0.0, 0.0, 90.0), camera_widening=-45.0
    )
    camera = recorded(constant_policy(0), task=TWO_AHEAD, appearance=look)["/world/camera"]
    assert camera["Transform3D:translation"][0] == [pytest.approx([0.4, 0.5, 2.5])]
    x, y, z, w = camera["Transform3D:quaternion"][0][0]
    forward = [-2 * (x * z + w * y), -2 * (y * z - w * x), -(1 - 2 * (x * x + y * y))]
    assert forward == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)  # to the left
    assert camera["Pinhole:image_from_camera"][0][0][0] == pytest.approx(32.0)  # 90 degrees


def test_distractors_have_their_places_and_sizes(recorded):
    look = AppearanceSettings(distractors=2, distractor_size=2.0)
    found = recorded(constant_policy(0), task=TWO_AHEAD, appearance=look)
    for name in ("distractor_0", "distractor_1"):
        box = found[f"/world/objects/{name}"]
        assert box["Boxes3D:half_sizes"] == {0: [pytest.approx([1.0] * 3)]}
        assert box["Boxes3D:centers"][0][0][2] == pytest.approx(1.0)  # on the ground
        assert box["Boxes3D:class_ids"] == {0: [SemanticClass.DISTRACTOR]}


def test_heat_maps_are_laid_over_observations(recorded, make_pipeline):
    def sharpen(network):
        with torch.no_grad():  # a policy with opinions, or every map would be nearly flat
            network.layers.logits.weight.mul_(300)

    found = recorded(constant_policy(0), sharpen, task=TWO_AHEAD)
    env, own = make_pipeline(1, task=TWO_AHEAD)
    sharpen(network_of(own))
    state, observations = env.reset(), []
    for _ in range(STEPS):
        observations.append(state["pixels"][0])
        state = env.step(state.set("action", torch.tensor([0])))["next"]
    every = torch.stack([*observations, state["pixels"][0]])
    explainer = Explainer(network_of(own), absent=every[0])
    inputs = every[:-1], torch.zeros(STEPS, dtype=torch.int64)
    maps = {"grad_cam": explainer.grad_cam(*inputs)}
    maps["grad_cam_logit"] = explainer.grad_cam(*inputs, "logit")
    low, high = float(every.min()), float(every.max())
    for step in range(STEPS):
        image = shown_picture(every[step].numpy(), low, high, "gray")
        assert np.array_equal(image_of(found["/observation"], step), image)
        by = next((name for name, of in maps.items() if of[step].max() > 0), None)
        heat = maps[by or "grad_cam"][step].numpy()
        assert np.array_equal(image_of(found["/heat_map"], step), heated(image, heat))
        said = found["/heat_map/method"]["TextLog:text"].get(step)
        assert said == (None if by is None else [f"heat map: {by}"])
    assert found["/heat_map/method"]["TextLog:text"]
    assert found["/heat_map"]["Clear:is_recursive"] == {STEPS: [False]}  # no action, no map


def test_a_recurrent_policy_is_recorded_without_heat_maps(tmp_path):
    described = describe(TrainSettings(network=Lstm(), task=TWO_AHEAD))
    env, network = described.build_env(1, seed=0, device="cpu"), described.build_network()
    with contextlib.closing(env), _open(rerun, tmp_path / "episode.rrd", "test") as stream:
        actor = make_actor(network, env.action_spec)
        record_episode(env, actor, network, EpisodeLog(rerun, stream, env))
    found = read(tmp_path / "episode.rrd")
    assert "/heat_map" not in found and len(found["/observation"]["Image:buffer"]) > 1


def test_a_policy_without_gradients_has_no_heat_maps(recorded):
    def freeze(network):
        network.is_differentiable = False

    found = recorded(constant_policy(0), freeze, task=TWO_AHEAD)
    assert "/heat_map" not in found and sorted(found["/observation"]["Image:buffer"]) == EVERY


@pytest.mark.parametrize(
    ("options", "names"),
    [
        ({"task": Posts()}, {"post_0", "post_1"}),
        ({"task": PillarsSettings(num_rows=1)}, {"pillar_0", "pillar_1"}),
    ],
)
def test_other_tasks_are_recorded_too(recorded, options, names):
    found = recorded(constant_policy(0), **options)
    for name in names:
        box = found[f"/world/objects/{name}"]
        assert box["Boxes3D:class_ids"] == {0: [SemanticClass.OBSTACLE]}
        assert "Clear:is_recursive" not in box


def test_a_recording_is_of_the_policys_episodes(tmp_path):
    policy = drone_rl.load_policy("good").in_task(num_cubes=1, first_distance=4.0)
    files = record(policy, tmp_path / "new", 2, greedy=False, seed=3)
    assert [file.name for file in files] == ["episode_0.rrd", "episode_1.rrd"]
    with policy.flying(1, seed=3) as (env, actor), torch.no_grad():
        for file in files:
            found, state, step = read(file), env.reset(), 0
            poses = found["/world/drone"]["Transform3D:translation"]
            chances = found["/action/probabilities"]["Scalars:scalars"]
            while not state["done"].all():
                with exploring(greedy=False):
                    acted = actor(state.clone(False))
                assert poses[step] == [pytest.approx(state["info", "drone"][0].tolist())]
                assert sum(chances[step]) == pytest.approx(1.0)
                assert chances[step] == pytest.approx(acted["logits"][0].softmax(-1).tolist())
                name = ["forward", "left", "right"][int(acted["action"][0])]
                assert found["/action/taken"]["TextLog:text"][step] == [name]
                state = env.step(state.set("action", acted["action"]))["next"]
                step += 1
            assert sorted(poses) == list(range(step + 1))
            assert sorted(chances) == list(range(step))


def test_each_file_is_a_recording_of_its_own_with_a_layout(tmp_path):
    policy = drone_rl.load_policy("flight").in_task(num_cubes=1, first_distance=3.0)
    files = record(policy, tmp_path, 2)
    readers = [RrdReader(file) for file in files]
    entries = [entry for reader in readers for entry in reader.recordings()]
    assert len({entry.recording_id for entry in entries}) == 2
    assert {entry.application_id for entry in entries} == {"drone-rl"}
    assert all(len(reader.blueprints()) == 1 for reader in readers)


def test_seconds_of_a_step():
    flying = DynamicsSettings(mode="simple_flight", control_ticks=50, tick=0.002)
    assert seconds_per_step(Quadrotor(flying)) == pytest.approx(0.1)
    assert seconds_per_step(Kinematic(ActionSettings(kind="velocity"), 0.25)) == 0.25
    assert seconds_per_step(ComputerVision()) == CONTROL_TIMESTEP_S


def test_mistakes(tmp_path, monkeypatch):
    policy = drone_rl.load_policy("good")
    with pytest.raises(InputError, match="episodes=0 records nothing; give 1 or more"):
        record(policy, tmp_path, 0)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"episode_0\.rrd can't be written .* another folder"):
        record(policy, tmp_path / "file", 1)
    monkeypatch.setenv("RERUN", "off")
    with pytest.raises(InputError, match=r"RERUN=off switches .* off; unset it"):
        record(policy, tmp_path, 1)
    monkeypatch.delenv("RERUN")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(InputError, match=r"format=rerun needs rerun, .* -e '\.\[rerun\]'"):
        record(policy, tmp_path, 1)
