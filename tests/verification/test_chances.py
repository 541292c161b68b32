"""Exact chances in Python, and how they show themselves."""

import dataclasses
import json

import pytest
import torch

import drone_rl
from drone_rl.config import AppearanceSettings
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.verification.prover.markov_chain import SuccessBounds

ONE = {"num_cubes": 1, "side_margin": 2.0}


@pytest.fixture(scope="module")
def good():
    return drone_rl.load_policy("good")


@pytest.fixture(scope="module")
def reported():
    """The progress of `several`."""
    return []


@pytest.fixture(scope="module")
def several(good, reported):
    def note(text, done=0, total=0):
        reported.append((done, total))

    return drone_rl.chances(good, [[6.0], [0.0]], task=ONE, progress=note)


def test_of_placements_that_are_given(several, tmp_path):
    done = several
    assert done.cubes.tolist() == [[[15.0, 6.0, 2.5]], [[15.0, 0.0, 2.5]]]
    assert 0.9 < done.success <= 1.0
    assert done.outcomes.success.shape == (2,)
    done.save(tmp_path / "chances.json")
    kept = json.loads((tmp_path / "chances.json").read_text())
    assert [p["cubes"][0][1] for p in kept["placements"]] == [6.0, 0.0]
    for placement in kept["placements"]:
        assert placement["within"] is None
        ends = placement["ends"]
        assert sum(e["probability"] for e in ends) == pytest.approx(1.0, abs=1e-12)
        collected = sum(e["probability"] for e in ends if e["collected"] == [True])
        assert collected == pytest.approx(placement["success"], abs=1e-12)
    assert kept["pictures"] == done.num_images > 100
    assert "seed" not in kept and "seed" not in str(done)


def test_bounds_wherever_the_cubes_stand_beside_a_placement(good, tmp_path):
    told = []
    done = drone_rl.chances(
        good, [5.98], task=ONE, within=0.05, parts=2, progress=lambda *how: told.append(how[0])
    )
    (bounds,) = done.bounded
    assert bounds.least <= done.success <= bounds.most <= 1.0
    assert "bounds" in told
    names = [row[0] for row in done.rows()]
    assert "within 0.05 m, everywhere at least" in names and len(names) == len({*names})
    done.save(tmp_path / "chances.json")
    (placement,) = json.loads((tmp_path / "chances.json").read_text())["placements"]
    assert placement["within"]["metres"] == 0.05
    assert placement["within"]["least"] == bounds.least


def test_bounds_are_of_places_where_cubes_may_stand(good, monkeypatch):
    boxes = []

    def bound(_, box, parts):
        boxes.append(box.tolist())
        return SuccessBounds(0.0, 1.0, 0.0, 1.0)

    monkeypatch.setattr("drone_rl.verification.chances.bound_success", bound)
    drone_rl.chances(good, [[5.75], [-6.0], [1.0]], task=ONE, within=0.5, progress=silent)
    assert boxes == [[[5.25, 6.0]], [[-6.0, -5.5]], [[0.5, 1.5]]]


def test_held_out_placements_are_those_of_a_verdict(good):
    done = drone_rl.chances(good, placements=2, task=ONE, progress=silent)
    assert str(done).endswith(f"placements: seed {done.seed.value} (fresh)")
    assert done.as_dict()["seed_is_fixed"] is False
    with good.in_task(**ONE).flying(2, seed=done.seed.value) as (env, _):
        env.reset()
        assert torch.equal(done.cubes, env.base_env.worlds.state.cubes)
    fixed = drone_rl.chances(good, placements=1, seed=0, task=ONE, progress=silent)
    assert not torch.equal(fixed.cubes[0], done.cubes[0])
    assert fixed.as_dict()["seed"] == 0
    assert "Fixed seed 0: a policy could have been fitted to these placements." in str(fixed)


def test_it_says_how_far_it_is(several, reported):
    assert reported == [(0, 2), (2, 2)]


def test_an_appearance_that_varies_is_refused(good):
    """Only the middle of its ranges would be rendered."""
    varied = good.in_appearance(AppearanceSettings(fog_visibility=(5.0, 1000.0)))
    with pytest.raises(InputError, match="exact probabilities support only appearances without"):
        drone_rl.chances(varied, [6.0], task=ONE, progress=silent)


def test_the_tables(good, several):
    rows = [row.split("  ")[0] for row in str(several).splitlines()]
    assert rows[1:5] == ["all cubes", "not all cubes", "mean cubes", "cube 1 collected"]
    assert str(several).splitlines()[0].split() == ["mean", "least", "most"]
    assert rows[-1] == "2 placements; no failure was found at any of them"
    assert "<td>ended: front boundary</td>" in several._repr_html_()
    one = drone_rl.chances(good, [6.0], task=ONE, progress=silent)
    assert str(one).splitlines()[0].split() == ["chance"]
    assert str(one).endswith("cubes at [6] metres to the left")


@pytest.mark.parametrize(
    ("cubes", "change", "message"),
    [
        ([1.0, 2.0], {}, r"cubes=\[1.0, 2.0\] must have 3"),
        ([], {}, "must have 3"),
        (["a", "b", "c"], {}, "are not numbers"),
        ([0.0, 7.0, 0.0], {}, "give metres to the left from -6 to 6"),
        ([0.0, float("nan"), 0.0], {}, "give metres to the left from -6 to 6"),
        (None, {"placements": 0}, "placements=0 is out of range"),
        (None, {"task": {"num_cubes": 20}}, "num_cubes=20"),
        (None, {"count": 1}, "count is unknown; valid names: .*placements"),
    ],
)
def test_mistakes_are_told_in_a_line(good, cubes, change, message):
    with pytest.raises(InputError, match=message):
        drone_rl.chances(good, cubes, progress=silent, **change)


def test_flights_have_no_places_that_could_be_counted(good):
    with pytest.raises(InputError, match="exact probabilities support only dynamics"):
        drone_rl.chances(good.in_dynamics(mode="simple_flight"), progress=silent)


def test_no_placement_is_called_the_worst_if_none_fails(several):
    ends = several.outcomes.ends.clone()
    ends[:, [end for end in EndReason if end != EndReason.ALL_CUBES]] = 0.0
    sure = dataclasses.replace(several, outcomes=dataclasses.replace(several.outcomes, ends=ends))
    assert "most probable" not in str(sure)
    ends[1, EndReason.SIDE_BOUNDARY] = 0.5
    worst = f"cubes=[{several.cubes[1, 0, 1]:g}]"
    assert f"2 placements; failure is most probable at {worst}" in str(sure)


def test_bounds_that_there_cannot_be_are_refused_first(good, monkeypatch):
    monkeypatch.setattr("drone_rl.verification.chances.explore", lambda *_: pytest.fail("computed"))
    with pytest.raises(InputError, match="support only appearance=minimal"):
        drone_rl.chances(good.in_appearance("fog"), [6.0], task=ONE, within=0.05, progress=silent)
