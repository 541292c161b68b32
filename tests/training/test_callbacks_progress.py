"""Progress of a training run in files and callbacks."""

import dataclasses

from drone_rl.policies.zoo.files import load_exported
from drone_rl.training import Callback
from drone_rl.training.callbacks import OngoingTraining, Progress
from drone_rl.trust.export import export_policy
from tests.policies.zoo.test_files import CHECKPOINT
from tests.training_loop import run
from tests.trust.cards import VERDICT


def test_progress_starts_at_zero():
    assert set(dataclasses.asdict(Progress()).values()) == {0}


def test_exported_files_contain_progress(tmp_path):
    progress = dataclasses.asdict(Progress(7, 5, 3, 1.5, 2.25))
    path = tmp_path / "policy.safetensors"
    checkpoint = {**CHECKPOINT, "progress": progress}
    export_policy(path, checkpoint, command="drone-rl train", verdict=VERDICT, seed=0, chosen=None)
    assert load_exported(path)["progress"] == progress


def test_callbacks_receive_the_trainer_interface(make_trainer):
    class Look(Callback):
        def on_update(self, training: OngoingTraining, metrics):
            names = [*OngoingTraining.__annotations__, "state_dict"]
            assert all(hasattr(training, name) for name in names)
            assert isinstance(training.progress, Progress)
            training.stop_request = "seen"

    assert run(make_trainer(callbacks=[Look()])) == "seen"
