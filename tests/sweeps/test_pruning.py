"""A search stops the hopeless early."""

from types import SimpleNamespace

import pytest

optuna = pytest.importorskip("optuna", reason="pip install -e '.[optuna]'")

from drone_rl.sweeps.pruning import PruneCallback  # noqa: E402
from drone_rl.sweeps.search import next_trials, note_outcome  # noqa: E402
from tests.sweeps.test_search import SPACE, begin  # noqa: E402


@pytest.mark.parametrize(("prune", "reason"), [(True, "pruned"), (False, "")])
def test_a_run_below_the_median_is_stopped(tmp_path, prune, reason):
    study = begin(tmp_path, prune=prune)
    next_trials(study, SPACE, 2, seed=0)
    reasons = []
    for number, cubes in ((0, 2.0), (1, 0.5)):
        trainer = SimpleNamespace(
            progress=SimpleNamespace(frames=0, running_reward=cubes), stop_request=""
        )
        callback = PruneCallback(tmp_path, number)
        for frames in (50, 120, 130, 250):
            trainer.progress.frames = frames
            callback.on_update(trainer, {})
        reasons.append(trainer.stop_request)
        note_outcome(
            study, number, {"reason": trainer.stop_request or "frames", "running_reward": cubes}
        )
    assert reasons == ["", reason]
    assert list(study.trials[0].intermediate_values) == [1, 2]
