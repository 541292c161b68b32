"""Training from Python equals training from the command line and resumes bit for bit."""

import shutil
import signal

import pytest
import torch
import yaml

import drone_rl
from drone_rl.config import DynamicsSettings, TaskSettings
from drone_rl.config.learning import Episodes
from drone_rl.config.training import TrainerSettings, TrainSettings
from drone_rl.training import Callback
from drone_rl.training.train import make_collector
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.run_result import RunResult
from tests.forked import run_forked

TINY = TrainSettings(
    task=TaskSettings(num_cubes=1, first_distance=8.0, step_limit=60),
    collector=Episodes(num_envs=4),
    trainer=TrainerSettings(total_frames=300),
)


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    messages = []
    folder = tmp_path_factory.mktemp("run") / "mine"

    def note(text, done=0, total=0):
        messages.append((text, done, total))

    return drone_rl.train(TINY, folder=folder, progress=note), messages


def weights(folder):
    return drone_rl.load_policy(folder).state.weights


def test_training_writes_the_same_files_as_the_command(trained):
    done, messages = trained
    assert done.reason == "frames"
    assert {p.name for p in done.folder.iterdir() if p.suffix} == {
        *("metrics.csv", "result.json", "run.yaml"),
    }
    assert RunResult.of(done.folder) == done.result
    noted = yaml.safe_load((done.folder / "run.yaml").read_text())
    assert noted["config"]["task"]["num_cubes"] == 1
    assert noted["description"]["network"]["name"] == "small_cnn"
    assert messages[-1][0] == "stopped: frames"
    assert done.policy.name == "mine"


def test_resumed_training_equals_an_uninterrupted_one(trained, tmp_path):
    longer = TINY.trainer.replace(total_frames=900)
    whole = drone_rl.train(TINY, folder=tmp_path / "whole", trainer=longer, progress=silent)
    half = drone_rl.train(TINY, folder=tmp_path / "half", progress=silent)
    assert half.result.frames < 900
    again = drone_rl.train(folder=half.folder, resume=True, trainer=longer, progress=silent)
    assert again.result.frames == whole.result.frames
    one, two = weights(whole.folder), weights(again.folder)
    assert all(torch.equal(one[name], two[name]) for name in one)


def test_run_killed_before_its_first_update_resumes(trained, tmp_path):
    class Killed(BaseException):
        pass

    class Kill(Callback):
        def on_start(self, training):
            raise Killed

    with pytest.raises(Killed):
        drone_rl.train(TINY, folder=tmp_path, callbacks=[Kill()], progress=silent)
    done = drone_rl.train(folder=tmp_path, resume=True, progress=silent)
    there, whole = weights(done.folder), weights(trained[0].folder)
    assert all(torch.equal(there[name], whole[name]) for name in whole)


def test_resuming_with_other_settings_raises(trained):
    done, _ = trained
    with pytest.raises(InputError, match=r"can't resume with seed=5: .* seed=0"):
        drone_rl.train(TINY, folder=done.folder, resume=True, seed=5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"objective": "ppo", "returns": {"lmbd": 1}}, "returns.lmbd is unknown; .* mean lmbda"),
        (
            {"tower": 3},
            "tower is unknown; valid names: task, appearance, dynamics, actions, camera",
        ),
        ({"lr": 3}, r"lr is unknown; .*mean optimizer=drone_rl\.config\.learning\.Adam\(lr="),
    ],
)
def test_invalid_arguments_are_named(change, message, tmp_path):
    with pytest.raises(InputError, match=f"^{message}"):
        drone_rl.train(folder=tmp_path, **change)
    assert not list(tmp_path.iterdir())


def test_training_with_dynamics_resumes(tmp_path, trained):
    flight = DynamicsSettings(mode="simple_flight", gusts=1.0)
    task = TaskSettings(num_cubes=1, first_distance=3.0, step_limit=20, front_margin=2.0)
    short = TrainerSettings(total_frames=100, confirm_episodes=0)
    settings = TINY.replace(task=task, dynamics=flight, trainer=short)
    whole = settings.replace(trainer=short.replace(total_frames=200))
    drone_rl.train(settings, folder=tmp_path / "parts", progress=silent)
    parts = drone_rl.train(whole, folder=tmp_path / "parts", resume=True, progress=silent)
    once = drone_rl.train(whole, folder=tmp_path / "once", progress=silent)
    own, other = weights(parts.folder), weights(once.folder)
    assert all(torch.equal(own[name], other[name]) for name in own)
    assert parts.policy.dynamics == flight and parts.policy.unlike == {}
    assert "end/lost_control" in parts.metrics()
    assert "end/lost_control" not in trained[0].metrics()  # dynamics that cannot lose control
    with pytest.raises(InputError, match=r"^can't resume with dynamics\.gusts=2\.0: "):
        windy = whole.replace(dynamics=flight.replace(gusts=2.0))
        drone_rl.train(windy, folder=parts.folder, resume=True, progress=silent)


class Stop(Callback):
    """Send signals to this process after an update, or before the first."""

    def __init__(self, *numbers, update=1):
        self.numbers, self.update = numbers, update

    def send(self):
        for number in self.numbers:
            signal.raise_signal(number)

    def on_start(self, training):
        if self.update == 0:
            self.send()

    def on_update(self, training, metrics):
        if training.progress.updates == self.update:
            self.send()


@pytest.fixture
def handlers():
    """Install Python's default handlers; return a function that sets others."""
    defaults = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}
    before = {number: signal.signal(number, handler) for number, handler in defaults.items()}
    yield signal.signal
    for number, handler in before.items():
        signal.signal(number, handler)


def assert_resumes(folder, trained):
    """Assert that the resumed training equals the uninterrupted one."""
    drone_rl.train(folder=folder, resume=True, progress=silent)
    there, whole = weights(folder), weights(trained[0].folder)
    assert all(torch.equal(there[name], whole[name]) for name in whole)


@pytest.mark.parametrize("update", [0, 1])
@pytest.mark.parametrize(
    ("number", "raised", "args"),
    [
        (signal.SIGINT, KeyboardInterrupt, "resume=True"),
        (signal.SIGTERM, SystemExit, "143"),
    ],
)
def test_signal_takes_effect_after_the_state_is_saved(
    trained, tmp_path, handlers, number, raised, args, update
):
    with pytest.raises(raised, match=args) as stopped:
        drone_rl.train(TINY, folder=tmp_path, callbacks=[Stop(number, update=update)])
    done = stopped.value.training
    assert done.reason == number.name
    assert RunResult.read_json(tmp_path / "result.json") == done.result
    assert done.result.updates == update
    assert_resumes(tmp_path, trained)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_custom_signal_handler_is_called(tmp_path, handlers, number):
    got = []
    handlers(number, lambda n, frame: got.append(n))
    done = drone_rl.train(TINY, folder=tmp_path, callbacks=[Stop(number)], progress=silent)
    assert got == [number] and done.reason == number.name


def test_stopped_confirmation_is_repeated_on_resume(tmp_path, handlers, monkeypatch):
    flown = []

    def confirm(self, update):
        flown.append(update)
        if len(flown) == 1:
            signal.raise_signal(signal.SIGINT)
        return True

    monkeypatch.setattr("drone_rl.training.confirmation.Confirmation.__call__", confirm)
    easy = TINY.replace(trainer=TINY.trainer.replace(target_share=1e-9))
    with pytest.raises(KeyboardInterrupt):
        drone_rl.train(easy, folder=tmp_path, progress=silent)
    done = drone_rl.train(folder=tmp_path, resume=True, progress=silent)
    assert done.reason == "solved" and len(flown) == 2 and flown[0] == flown[1]


@pytest.mark.parametrize(
    ("number", "statuses"),
    [
        (signal.SIGINT, (-signal.SIGINT, 1)),  # 1 if Ray is installed, because of its exit handler
        (signal.SIGTERM, (143,)),
    ],
)
def test_signal_ends_a_loop_of_trainings(tmp_path, number, statuses):
    code = (
        "import os, signal, threading, time, drone_rl\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "def send():\n"
        "    while not os.path.exists('run0/metrics.csv'):\n"
        "        time.sleep(0.02)\n"
        f"    os.kill(os.getpid(), {int(number)})\n"
        "threading.Thread(target=send, daemon=True).start()\n"
        "short = drone_rl.TrainerSettings(total_frames=10_000_000)\n"
        "for seed in range(3):\n"
        "    drone_rl.train(folder=f'run{seed}', seed=seed, trainer=short)\n"
    )
    done = run_forked(code, cwd=tmp_path)
    assert done.returncode in statuses, done.stderr
    assert ("KeyboardInterrupt: training stopped" in done.stderr) == (number == signal.SIGINT)
    assert [path.name for path in tmp_path.iterdir()] == ["run0"]
    state = drone_rl.load_policy(tmp_path / "run0").state.progress
    rows = (tmp_path / "run0" / "metrics.csv").read_text().splitlines()
    assert state.updates == len(rows) - 1


def test_a_finished_run_is_not_replaced(tmp_path):
    (tmp_path / "result.json").write_text("{}")
    with pytest.raises(InputError, match=r"holds a finished run, .*resume=True.*another folder"):
        drone_rl.train(TINY, folder=tmp_path, progress=silent)
    assert (tmp_path / "result.json").read_text() == "{}"


def test_names_of_other_projects():
    for name, meant in (("learning_rate", r"Adam\(lr"), ("num_workers", r"Episodes\(num_threads")):
        with pytest.raises(InputError, match=rf"^{name} is unknown; .*did you mean .*{meant}="):
            drone_rl.train(**{name: 1})


def test_a_result_is_forgotten_once_the_run_goes_on(trained, tmp_path):
    class Killed(BaseException):
        pass

    class Kill(Callback):
        def on_update(self, training, metrics):
            raise Killed

    folder = shutil.copytree(trained[0].folder, tmp_path / "run")
    longer = TINY.trainer.replace(total_frames=900)
    with pytest.raises(Killed):
        drone_rl.train(
            folder=folder, resume=True, trainer=longer, callbacks=[Kill()], progress=silent
        )
    assert not (folder / "result.json").exists()


@pytest.mark.parametrize("compiled", [True, False])
def test_weights_of_rewards_are_those_of_the_settings(compiled):
    """Each cube pays 2.5, not the default of 1."""
    task = TaskSettings(reward={"reached": {"weight": 2.5}})
    collector = Episodes(num_envs=4, compiled=compiled)
    made = make_collector(TrainSettings(task=task, collector=collector)).collector
    rewards = next(iter(made))["next", "reward"]
    made.shutdown()
    assert set(rewards.unique().tolist()) == {0.0, 2.5}
