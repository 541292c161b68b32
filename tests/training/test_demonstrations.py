"""Files of flights: what was written is read again, and anything else is refused in one line."""

import io
import re

import numpy as np
import pytest
import torch

from drone_rl.collectors.complete_episodes import rollout
from drone_rl.config import (
    ActionSettings,
    CameraSettings,
    DynamicsSettings,
    PillarsSettings,
    TaskSettings,
)
from drone_rl.config.training import TrainSettings
from drone_rl.envs import DroneEnv
from drone_rl.policies.baselines import OracleAgent
from drone_rl.training.demonstrations import (
    Demonstration,
    FlightConditions,
    add_demonstration,
    read_demonstration,
    read_demonstrations,
    record_oracle,
)
from drone_rl.utils.errors import InputError

CAMERA = CameraSettings(width=4, height=2)
CONDITIONS = FlightConditions.of(TrainSettings(camera=CAMERA))
VELOCITY = FlightConditions.of(
    TrainSettings(camera=CAMERA, actions=ActionSettings(kind="velocity"))
)


def flight(steps=3, conditions=CONDITIONS, **changes):
    """Return a flight whose bytes are all different."""
    number = np.arange(steps)
    values = {
        "images": np.arange(steps * 24, dtype=np.uint8).reshape(steps, 2, 4, 3),
        "actions": number % 3,
        "rewards": (0.5 * number).astype(np.float32),
        "done": number == steps - 1,
    }
    return Demonstration(conditions, **{**values, **changes})


def contents(one):
    """Return the arrays of a flight's file, as a stranger may change them."""
    return dict(np.load(io.BytesIO(one.to_bytes())))


def crafted(path, **changes):
    """Write a file with other arrays; None removes one."""
    arrays = {k: v for k, v in {**contents(flight()), **changes}.items() if v is not None}
    np.savez_compressed(path, **arrays)
    return path


@pytest.mark.parametrize(
    "one",
    [
        flight(),
        flight(1, pilot="oracle"),
        flight(2, done=np.zeros(2, bool)),  # cut before its end
        flight(2, VELOCITY, actions=np.array([[-1, 0.25, 1], [0, 0, 0]], np.float32)),
    ],
)
def test_a_flight_is_read_as_it_was_written(tmp_path, one):
    path = add_demonstration(tmp_path / "new" / "folder", one)
    again = read_demonstration(path)
    for name in ("images", "actions", "rewards", "done"):
        written, read = getattr(one, name), getattr(again, name)
        assert (read.shape, read.dtype) == (written.shape, written.dtype)
        assert read.tobytes() == written.tobytes()
    assert (again.pilot, again.conditions, len(again)) == (one.pilot, one.conditions, len(one))


def test_flights_are_numbered_and_read_in_order(tmp_path):
    steps = (1, 2, 3)
    paths = [add_demonstration(tmp_path, flight(n)) for n in steps]
    assert [path.name for path in paths] == [f"flight_0000{i}.npz" for i in range(3)]
    paths[0].unlink()
    (tmp_path / "notes.txt").write_text("mine")
    assert add_demonstration(tmp_path, flight(4)).name == "flight_00003.npz"
    paths[1].rename(tmp_path / "flight_100000.npz")
    assert add_demonstration(tmp_path, flight(5)).name == "flight_100001.npz"
    assert [len(one) for one in read_demonstrations(tmp_path)] == [3, 4, 2, 5]
    left = {path.name for path in tmp_path.iterdir() if path.suffix != ".npz"}
    assert left == {"notes.txt", ".lock"}  # no half-written file


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("images", np.zeros((2, 2, 4, 3), np.uint8)),
        ("images", np.zeros((3, 2, 4, 3), np.float32)),
        ("actions", np.zeros(3, np.int32)),
        ("actions", np.array([0, 3, 0])),
        ("steps", np.zeros(0, np.int64)),
        ("rewards", np.array([0, np.nan, 0], np.float32)),
        ("done", np.array([False, True, True])),
    ],
)
def test_wrong_arrays_are_refused_when_written_and_read(tmp_path, name, value):
    changes = {"actions" if name == "steps" else name: value}
    with pytest.raises(InputError, match=name):
        flight(**changes)
    with pytest.raises(InputError, match=f"flight_00000.npz can't be used .*{name}"):
        read_demonstration(crafted(tmp_path / "flight_00000.npz", **changes))


@pytest.mark.parametrize("number", [np.nan, 1.5, -1.01])
def test_continuous_actions_out_of_bounds_are_refused(number):
    actions = np.array([[0, 0, number]], np.float32)
    with pytest.raises(InputError, match=r"^actions are not all from -1\.0 to 1\.0"):
        flight(1, VELOCITY, actions=actions)


WHOLE = flight().to_bytes()


@pytest.mark.parametrize(
    "content",
    [
        b"\x80\x04N.",
        WHOLE[:-30],
    ],
)
def test_damaged_files_are_refused(tmp_path, content):
    path = tmp_path / "flight_00000.npz"
    path.write_bytes(content)
    with pytest.raises(InputError, match=re.escape(str(path))):
        read_demonstrations(tmp_path)


@pytest.mark.parametrize(
    "changes",
    [
        {"about": None},
        {"about": np.array("{" * 9)},
        {"about": np.array('{"format": "drone_rl demonstration", "format_version": 2}')},
    ],
)
def test_other_contents_are_refused(tmp_path, changes):
    with pytest.raises(InputError, match=r"flight_00000\.npz"):
        read_demonstration(crafted(tmp_path / "flight_00000.npz", **changes))


def test_a_folder_without_flights_is_refused(tmp_path):
    for folder in (tmp_path / "missing", tmp_path):
        with pytest.raises(InputError, match=f"^demonstrations={folder}"):
            read_demonstrations(folder)


FLYING = DynamicsSettings(mode="simple_flight")


VELOCITIES = ActionSettings(kind="velocity")


@pytest.mark.parametrize(
    ("recorded", "needed", "name"),
    [
        ({}, {"camera": CameraSettings(width=4, height=3)}, "camera.height=2"),
        ({}, {"task": TaskSettings(num_cubes=2)}, "task.num_cubes=3"),
        ({}, {"task": PillarsSettings()}, "task.name=collect_cubes"),
        ({}, {"dynamics": FLYING}, "dynamics.mode=computer_vision"),
        ({"dynamics": FLYING}, {"dynamics": FLYING.replace(wind=(0, 5, 0))}, "dynamics.wind"),
        (
            {"actions": VELOCITIES},
            {"actions": VELOCITIES, "dynamics": DynamicsSettings(control_ticks=10)},
            "dynamics.control_ticks=33",
        ),
        (
            {"actions": ActionSettings(kind="moves_turning")},
            {"actions": ActionSettings(kind="moves_turning", turn_step=30.0)},
            "actions.turn_step=15.0",
        ),
    ],
)
def test_flights_under_other_conditions_are_refused(recorded, needed, name):
    own = FlightConditions.of(TrainSettings(**{"camera": CAMERA, **recorded}))
    other = FlightConditions.of(TrainSettings(**{"camera": CAMERA, **needed}))
    own.check_same(own, "x.npz")
    with pytest.raises(InputError, match=f"^x.npz was recorded with {name}"):
        own.check_same(other, "x.npz")


def test_values_without_an_effect_may_differ():
    other = TrainSettings(
        camera=CAMERA,
        dynamics=DynamicsSettings(mass=0.9, control_ticks=5),
        actions=ActionSettings(move_speed=9.0),
        seed=5,
    )
    CONDITIONS.check_same(FlightConditions.of(other), "x.npz")


def test_conditions_of_a_folder_are_compared(tmp_path):
    add_demonstration(tmp_path, flight())
    assert len(read_demonstrations(tmp_path, CONDITIONS)) == 1
    with pytest.raises(InputError, match=r"flight_00000.npz was recorded with camera.width=4, but"):
        read_demonstrations(tmp_path, FlightConditions.of(TrainSettings()))


EASY = TrainSettings(
    task=TaskSettings(num_cubes=1, first_distance=6.0, step_limit=40),
    camera=CameraSettings(width=16, height=8),
)


@pytest.mark.parametrize("kind", ["moves", "velocity"])
def test_the_oracle_is_recorded_as_it_flies(tmp_path, kind):
    settings = EASY.replace(actions=ActionSettings(kind=kind))
    paths = record_oracle(tmp_path, settings, flights=3, seed=5)
    found = read_demonstrations(tmp_path, FlightConditions.of(settings))
    assert [path.name for path in paths] == [f"flight_0000{i}.npz" for i in range(3)]
    env = DroneEnv(3, settings.task, settings.camera, seed=5, actions=settings.actions)
    flown = rollout(OracleAgent(), env, 3)
    assert bool(flown.success.all())
    env.set_seed(5)
    first = env.reset()["pixels"].numpy()
    for i, one in enumerate(found):
        assert torch.equal(torch.from_numpy(one.actions), flown.each("action")[i])
        assert len(one) == int(flown.length[i]) and bool(one.done[-1])
        assert one.rewards.sum() == 1.0 and one.pilot == "oracle"
        assert np.array_equal(one.images[0], first[i])
    env.close()
    lengths = [len(one) for one in found]
    record_oracle(tmp_path, settings, flights=2, seed=5)  # the next episodes of the seed
    record_oracle(tmp_path / "all", settings, flights=5, seed=5)
    found, expected = read_demonstrations(tmp_path), read_demonstrations(tmp_path / "all")
    assert [len(one) for one in found] == [len(one) for one in expected]
    assert [len(one) for one in found][:3] == lengths
    for one, other in zip(found, expected, strict=True):
        assert np.array_equal(one.images, other.images)
    assert len({one.images.tobytes() for one in found}) == 5


def test_a_task_without_an_oracle_is_refused(tmp_path):
    rising = EASY.replace(task=EASY.task.replace(vertical_bound=5.0, altitude=12.0))
    with pytest.raises(InputError, match=r"task.vertical_bound=5.0 puts cubes|oracle of task"):
        record_oracle(tmp_path, rising, flights=1)
    assert not list(tmp_path.iterdir())
