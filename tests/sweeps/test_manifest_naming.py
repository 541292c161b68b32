"""The same command finds the same folder; another finds another."""

from drone_rl.sweeps.manifest import is_sweep, sweep_name


def test_what_counts_as_a_sweep():
    assert is_sweep(["-m", "seed=0,1"])
    assert is_sweep(["sweep=seeds"])
    assert not is_sweep(["seed=0"])
    assert not is_sweep(["sweep=seeds", "hydra.mode=RUN"])


def test_place_and_launcher_leave_the_name_as_it_is():
    name = sweep_name(["-m", "seed=0,1", "returns=reward_to_go"])
    assert name.startswith("seed-")
    elsewhere = ["seed=0,1", "returns=reward_to_go", "hydra/launcher=slurm", "paths.outputs=x"]
    assert sweep_name([*elsewhere, "hydra.launcher.num_jobs=3", "--multirun"]) == name


def test_other_values_or_settings_change_it():
    names = {sweep_name(o) for o in (["seed=0,1"], ["seed=0,2"], ["seed=0,1", "task=x"], [])}
    assert len(names) == 4
    assert sweep_name(["sweep=learning_rate"]).startswith("learning_rate-")
