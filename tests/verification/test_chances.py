"""Exact probabilities of episodes with sampled actions."""

import pytest
import torch

import drone_rl
from drone_rl.config import AppearanceSettings
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.verification.chances import Chances, _row

ONE = {"num_cubes": 1, "side_margin": 2.0}


@pytest.fixture(scope="module")
def good():
    return drone_rl.load_policy("good")


def test_given_placements(good, tmp_path):
    done = drone_rl.chances(good, [[6.0], [0.0]], task=ONE, progress=silent)
    assert [p.cubes for p in done.placements] == [((15.0, 6.0, 2.5),), ((15.0, 0.0, 2.5),)]
    assert 0.9 < done.success <= 1.0
    done.save(tmp_path / "chances.json")
    assert Chances.read_json(tmp_path / "chances.json") == done
    for placement in done.placements:
        assert sum(end.probability for end in placement.ends) == pytest.approx(1.0, abs=1e-12)
        assert placement.collected(0) == pytest.approx(placement.success, abs=1e-12)
        assert placement.ended("all_cubes") == pytest.approx(placement.success, abs=1e-12)
    assert done.pictures > 100
    assert done.seed is None and "seed" not in str(done)


def test_held_out_placements_are_those_of_an_evaluation(good):
    done = drone_rl.chances(good, placements=2, task=ONE, progress=silent)
    assert str(done).endswith(f"placements: seed {done.seed} (fresh)")
    assert done.seed_is_fixed is False
    with good.in_task(**ONE).flying(2, seed=done.seed) as (env, _):
        env.reset()
        placed = [p.cubes for p in done.placements]
        assert torch.equal(
            torch.tensor(placed, dtype=torch.float64), env.base_env.worlds.state.places
        )
    fixed = drone_rl.chances(good, placements=1, seed=0, task=ONE, progress=silent)
    assert fixed.placements[0].cubes != placed[0] and fixed.seed == 0
    assert "Fixed seed 0" in str(fixed)


def test_row_of_small_probabilities():
    assert _row("x", [5.696e-12, 0.25, 1.0]) == ["x", "41.67%", "<0.01%", "100%"]


@pytest.mark.parametrize(
    ("cubes", "change"),
    [
        ([1.0, 2.0], {}),
        ([0.0, 7.0, 0.0], {}),
        ([[[0.0, 0.0, 0.0]]], {}),
        (None, {"placements": 0}),
        (None, {"task": {"num_cubes": 20}}),
    ],
)
def test_unusable_arguments_are_refused(good, cubes, change):
    with pytest.raises(InputError, match=r"cubes=|placements=0|num_cubes=20|count is unknown"):
        drone_rl.chances(good, cubes, progress=silent, **change)


def test_unsupported_policies_are_refused(good):
    """Of an appearance with ranges only the middle would be rendered."""
    foggy = good.in_appearance(AppearanceSettings(fog_visibility=(5.0, 1000.0)))
    for policy, message in (
        (foggy, "exact probabilities support only appearances without ranges"),
        (good.in_dynamics(mode="simple_flight"), "support only dynamics=computer_vision"),
    ):
        with pytest.raises(InputError, match=message):
            drone_rl.chances(policy, [6.0], task=ONE, progress=silent)


def test_table(good):
    done = drone_rl.chances(good, [5.98], task=ONE, progress=silent)
    names = [row[0] for row in done.rows()]
    assert len(names) == len({*names})
    assert names[1] in str(done) and f"<td>{names[1]}</td>" in done._repr_html_()
