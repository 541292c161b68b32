"""Files of flights: what was written is read again, and anything else is refused in one line."""

import io
import json
import struct
import zipfile

import numpy as np
import pytest
import torch

from drone_rl.collectors.complete_episodes import StepLog, run_episodes
from drone_rl.config import (
    ActionSettings,
    CameraSettings,
    DynamicsSettings,
    PillarsSettings,
    TaskSettings,
)
from drone_rl.config.training import TrainSettings
from drone_rl.envs import DroneEnv
from drone_rl.policies.baselines import oracle_policy
from drone_rl.training import demonstrations
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


def about(**changes):
    """Return a description with changes; None removes an entry."""
    data = json.loads(str(contents(flight())["about"])) | changes
    return np.array(json.dumps({k: v for k, v in data.items() if v is not None}))


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


def test_an_unwritable_flight_leaves_no_file(tmp_path, monkeypatch):
    def fail(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("drone_rl.utils.files.os.replace", fail)
    with pytest.raises(OSError, match="No space left"):
        add_demonstration(tmp_path, flight())
    assert [path.name for path in tmp_path.iterdir()] == [".lock"]


WRONG = [
    ({"images": np.zeros((2, 2, 4, 3), np.uint8)}, r"images has shape \(2, 2, 4, 3\)"),
    ({"images": np.zeros((3, 4, 2, 3), np.uint8)}, r"images has shape \(3, 4, 2, 3\)"),
    ({"images": np.zeros((3, 2, 4, 3), np.float32)}, "images has .* type float32"),
    ({"images": np.zeros((3, 2, 4), np.uint8)}, "images has shape"),
    ({"actions": np.zeros(3, np.int32)}, "actions has .* type int32; .* int64"),
    ({"actions": np.zeros(3, ">i8")}, "actions has .* type >i8"),
    ({"actions": np.zeros((3, 3), np.float32)}, "actions has shape"),
    ({"actions": np.array([0, 3, 0])}, "actions are not all from 0 to 2"),
    ({"actions": np.array([0, -1, 0])}, "actions are not all from 0 to 2"),
    ({"actions": np.zeros(0, np.int64)}, "a flight has no steps"),
    ({"actions": np.array(0)}, "a flight has no steps"),
    ({"rewards": np.array([0, np.nan, 0], np.float32)}, "rewards hold NaN or infinity"),
    ({"rewards": np.array([0, np.inf, 0], np.float32)}, "rewards hold NaN or infinity"),
    ({"rewards": np.zeros(3)}, "rewards has .* type float64"),
    ({"rewards": np.zeros((3, 1), np.float32)}, "rewards has shape"),
    ({"done": np.array([False, True, True])}, "done is true before the last step"),
    ({"done": np.zeros(3, np.uint8)}, "done has .* type uint8"),
]
"""Arrays that are no flight, and what is said."""


@pytest.mark.parametrize(("changes", "message"), WRONG)
def test_wrong_arrays_are_refused_when_written_and_read(tmp_path, changes, message):
    with pytest.raises(InputError, match=f"^{message}"):
        flight(**changes)
    with pytest.raises(InputError, match=message) as error:
        read_demonstration(crafted(tmp_path / "flight_00000.npz", **changes))
    assert "flight_00000.npz can't be used as a demonstration" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("number", [np.nan, 1.5, -1.01])
def test_continuous_actions_out_of_bounds_are_refused(number):
    actions = np.array([[0, 0, number]], np.float32)
    with pytest.raises(InputError, match=r"^actions are not all from -1\.0 to 1\.0"):
        flight(1, VELOCITY, actions=actions)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"about": None}, "does not hold exactly about, images, actions, rewards, done"),
        ({"more": np.zeros(1)}, "does not hold exactly"),
        ({"rewards": None}, "does not hold exactly"),
        ({"about": np.zeros(3)}, "its description is no text"),
        ({"about": np.array(["{}", "{}"])}, "its description is no text"),
        ({"about": np.array("{" * 9)}, "its description is damaged"),
        ({"about": np.array("[" * 100 + "]" * 100)}, "must be a mapping"),
        ({"about": np.array('{"task": NaN}')}, "its description is damaged"),
        ({"about": np.array("3")}, "about=3 must be a mapping"),
        ({"about": about(camera=None)}, "about.camera is missing"),
        ({"about": about(more=1)}, "about.'more' is unknown"),
        ({"about": about(format="other")}, "it has the format 'other', version 1, not drone_rl"),
        ({"about": about(format=None)}, "it has the format None, version 1, not drone_rl"),
        ({"about": about(format_version=2, more=1)}, "version 2, not drone_rl demonstration, ver"),
        ({"about": about(format_version=True)}, "version True, not drone_rl demonstration"),
        ({"about": about(pilot="a\nb")}, "pilot='a.*nb' is no text"),
        ({"about": about(pilot=3)}, "pilot=3 is no text"),
        ({"about": about(task={"name": "chess"})}, "task.name='chess' is unknown"),
        ({"about": about(task={})}, "task.num_cubes is missing"),
        ({"about": about(camera={**CAMERA.values(), "width": 0})}, "camera.width=0 is out of"),
        ({"about": about(camera={**CAMERA.values(), "width": 5})}, "images has shape"),
        ({"about": about(dynamics=[])}, r"dynamics=\(list\) must be a mapping"),
        ({"about": about(actions=VELOCITY.actions.values())}, "actions has shape"),
        (
            {
                "about": about(
                    dynamics=DynamicsSettings(mode="simple_flight").values(),
                    actions=ActionSettings(kind="moves_3d").values(),
                )
            },
            "actions=moves_3d needs dynamics=computer_vision",
        ),
    ],
)
def test_crafted_contents_are_refused(tmp_path, changes, message):
    with pytest.raises(InputError, match=message) as error:
        read_demonstration(crafted(tmp_path / "flight_00000.npz", **changes))
    assert "flight_00000.npz" in str(error.value) and "\n" not in str(error.value)


def npy(shape, dtype="|u1", data=b""):
    header = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data


def zipped(**members):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)
    return file.getvalue()


WHOLE = flight().to_bytes()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x80\x04N.",  # a pickle
        WHOLE[:-30],
        zipped(images=npy((10**9, 2, 4, 3))),
        zipped(images=npy((2,), "|O", bytes(16))),
        zipped(images=npy((0, 2**40))),
    ],
    ids=range(6),
)
def test_damaged_and_huge_files_are_refused(tmp_path, content):
    path = tmp_path / "flight_00000.npz"
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        read_demonstrations(tmp_path)
    assert str(path) in str(error.value) and "\n" not in str(error.value)


def test_a_flight_that_could_not_be_read_again_is_refused(monkeypatch):
    size = 3 * (24 + 8 + 4 + 1)
    monkeypatch.setattr(demonstrations, "ARRAYS_BYTES", size)
    assert len(flight()) == 3
    monkeypatch.setattr(demonstrations, "ARRAYS_BYTES", size - 1)
    with pytest.raises(InputError, match=f"a flight of 3 steps takes {size} bytes, more than"):
        flight()


def test_a_folder_without_flights_is_refused(tmp_path, monkeypatch):
    missing = tmp_path / "missing"
    with pytest.raises(InputError, match=rf"^demonstrations={missing} can't be read \(No such"):
        read_demonstrations(missing)
    with pytest.raises(InputError, match=r"holds 0 files \*\.npz; give a folder with 1 to 10000"):
        read_demonstrations(tmp_path)
    path = add_demonstration(tmp_path, flight())
    with pytest.raises(InputError, match=r"can't be read \(Not a directory\)"):
        read_demonstrations(path)
    add_demonstration(tmp_path, flight())
    monkeypatch.setattr(demonstrations, "MOST_DEMONSTRATIONS", 1)
    with pytest.raises(InputError, match="holds 2 files"):
        read_demonstrations(tmp_path)


def test_links_and_folders_in_place_of_flights_are_refused(tmp_path):
    (tmp_path / "flight_00000.npz").mkdir()
    with pytest.raises(InputError, match=r"can't be read \(Is a directory\)"):
        read_demonstrations(tmp_path)
    (tmp_path / "flight_00000.npz").rmdir()
    (tmp_path / "flight_00000.npz").symlink_to("/dev/zero")
    with pytest.raises(InputError, match="is a link or a device"):
        read_demonstrations(tmp_path)


FLYING = DynamicsSettings(mode="simple_flight")


@pytest.mark.parametrize(
    ("recorded", "needed", "message"),
    [
        ({}, {"camera": CameraSettings(width=4, height=3)}, "camera.height=2, .* camera.height=3"),
        ({}, {"task": TaskSettings(num_cubes=2)}, "task.num_cubes=3, .* task.num_cubes=2"),
        ({}, {"task": PillarsSettings()}, "task.name=collect_cubes, .* task.name=pillars"),
        ({}, {"dynamics": FLYING}, "dynamics.mode=computer_vision, .* dynamics.mode=simple_flight"),
        (
            {"dynamics": FLYING},
            {"dynamics": FLYING.replace(wind=(0, 5, 0))},
            r"dynamics.wind=\[0\.0, 0\.0, 0\.0\], .* dynamics.wind=\[0\.0, 5\.0, 0\.0\]",
        ),
        (
            {"dynamics": FLYING},
            {"dynamics": FLYING, "actions": ActionSettings(move_speed=2.0)},
            "actions.move_speed=4.0, .* actions.move_speed=2.0",
        ),
        (
            {"actions": ActionSettings(kind="velocity")},
            {"actions": ActionSettings(kind="velocity", yaw_rate=0.0)},
            "actions.yaw_rate=45.0, .* actions.yaw_rate=0.0",
        ),
        (
            {"actions": ActionSettings(kind="velocity")},
            {
                "actions": ActionSettings(kind="velocity"),
                "dynamics": DynamicsSettings(control_ticks=10),
            },
            "dynamics.control_ticks=33, .* dynamics.control_ticks=10",
        ),
    ],
)
def test_flights_under_other_conditions_are_refused(recorded, needed, message):
    own = FlightConditions.of(TrainSettings(**{"camera": CAMERA, **recorded}))
    other = FlightConditions.of(TrainSettings(**{"camera": CAMERA, **needed}))
    own.check_same(own, "x.npz")
    with pytest.raises(InputError, match=f"^x.npz was recorded with {message}; give") as error:
        own.check_same(other, "x.npz")
    assert "\n" not in str(error.value)


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
    log = StepLog()
    flown = run_episodes(env, oracle_policy(settings.task, env.worlds.dynamics.actions), 3, log=log)
    assert bool(flown.success.all())
    env.set_seed(5)
    first = env.reset()["pixels"].numpy()
    for i, one in enumerate(found):
        assert torch.equal(torch.from_numpy(one.actions), log.actions[i])
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


def test_settings_of_the_oracles_training_may_be_given_by_name(tmp_path):
    record_oracle(tmp_path, EASY, flights=1, camera=CameraSettings(width=8, height=4))
    assert read_demonstrations(tmp_path)[0].images.shape[1:] == (4, 8, 3)
    with pytest.raises(InputError, match="flight is unknown; valid names"):
        record_oracle(tmp_path, EASY, flight=3)


def test_what_is_no_demonstration_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"conditions=.TrainSettings. is no FlightConditions; "):
        flight(conditions=TrainSettings())
    for name in ("images", "actions", "rewards", "done"):
        with pytest.raises(InputError, match=rf"{name}=\(list\) is no array; give one of numpy"):
            flight(**{name: [1, 0, 0]})
    with pytest.raises(InputError, match="settings=None is no TrainSettings"):
        FlightConditions.of(None)
    with pytest.raises(InputError, match=r"is no drone_rl\.Demonstration"):
        add_demonstration(tmp_path / "new", np.zeros(3))
    assert not list(tmp_path.iterdir())


def test_a_task_without_an_oracle_is_refused(tmp_path):
    rising = EASY.replace(task=EASY.task.replace(vertical_bound=5.0, altitude=12.0))
    with pytest.raises(InputError, match=r"task.vertical_bound=5.0 puts cubes|oracle of task"):
        record_oracle(tmp_path, rising, flights=1)
    assert not list(tmp_path.iterdir())
