"""Learning curves of runs: which runs are one curve, what it shows, and mistakes."""

import numpy as np
import pytest
import yaml

from drone_rl.sweeps.curves import plot_curves, success_rates
from drone_rl.utils.errors import InputError


def write_run(folder, seed, rewards, lr):
    (folder / ".hydra").mkdir(parents=True)
    rows = [f"{10 * i},{10 * i},{i},{r},1" for i, r in enumerate(rewards, start=1)]
    head = "frames,episodes,seconds,train/running_reward,end/" + ("stop" if seed else "all_cubes")
    (folder / "metrics.csv").write_text("\n".join([head, *rows]))
    (folder / "run.yaml").write_text(yaml.safe_dump({"config": {"seed": seed, "lr": lr}}))
    typed = [f"seed={seed}", f"optimizer.lr={lr}"]
    (folder / ".hydra" / "overrides.yaml").write_text(yaml.safe_dump(typed))


def lines(*arguments):
    """Label, x and y of each curve."""
    axes = plot_curves(*arguments).axes[0]
    return {str(n.get_label()): np.array(n.get_data()).tolist() for n in axes.lines}, axes


def test_runs_that_differ_only_in_their_seed_are_one_curve_with_a_band(tmp_path):
    for seed, rewards in enumerate([(0, 1), (1, 3), (2, 8)]):
        write_run(tmp_path / f"s{seed}", seed, rewards, 0.001)
    write_run(tmp_path / "other", 0, (5, 6), 0.01)
    curves, axes = lines([tmp_path])
    assert curves == {
        "optimizer learning rate=0.001 (runs: 3)": [[10, 20], [1, 3]],
        "optimizer learning rate=0.01 (runs: 1)": [[10, 20], [5, 6]],
    }
    bands = [c.get_paths()[0].get_extents() for c in axes.collections]
    assert sorted((band.ymin, band.ymax) for band in bands) == [(0, 8), (5, 6)]


def test_success_replaces_the_reward_where_all_runs_have_logged_it(tmp_path):
    write_run(tmp_path / "a", 0, (5, 6), 0.01)
    assert [*lines([tmp_path], "seconds")[0].values()] == [[[1, 2], [1, 1]]]


def test_success_is_that_of_the_last_hundred_episodes():
    episodes, rates = np.array([50.0, 100, 150, 150]), np.array([0.0, 0.4, 1.0, np.nan])
    assert success_rates(episodes, rates).tolist() == pytest.approx([0.0, 0.2, 0.7, 0.7])


def test_folders_without_curves_are_refused(tmp_path):
    write_run(tmp_path / "begun", 0, (), 1)
    with pytest.raises(InputError, match=r"contains no metrics.csv of updates; give folders"):
        plot_curves([tmp_path])
    write_run(tmp_path / "damaged", 0, ("many",), 1)
    with pytest.raises(InputError, match=r"^runs=.* failed in metrics.csv or run.yaml .*'many'"):
        plot_curves([tmp_path])
