"""Flights under other conditions from Python: a policy, a liar, mistakes."""

import pytest
import torch

import drone_rl
from drone_rl.config import TaskSettings
from drone_rl.sim.tasks import CollectCubes
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent

FEW = {"episodes": 12, "domain_episodes": 20, "strengths": [5], "seed": 0, "progress": silent}


@pytest.fixture(scope="module")
def done():
    return drone_rl.shifts("good", axes=["brightness", "late_frames"], modes=["constant"], **FEW)


def test_shifts_in_python(done):
    numbers = done
    assert [*numbers.axes] == ["brightness", "late_frames"]
    assert numbers.policy == "good" and numbers.settings.episodes == 12
    dark = numbers.axes["brightness"].levels[0]
    assert dark.value == 0.1 and dark.modes["constant"].success.share < 0.5
    assert numbers.plain.success.share == 1.0
    assert done.area == pytest.approx(sum(a.areas["constant"] for a in numbers.axes.values()) / 2)
    assert [len(done.frames(name)) for name in done.axes] == [6, 6]


def test_few_episodes_give_no_range(done):
    """Twenty flights are too few to be certain of anything."""
    domain = done.domain
    assert not domain.plain.good and not domain.plain.bad
    assert "no range" in done.sentence and "Good with" not in done.sentence


def test_shifts_files(done, tmp_path):
    done.save(tmp_path)
    kept = drone_rl.Shifts.read_json(tmp_path / "shifts.json")
    assert kept.axes == done.axes and kept.versions
    for name in ("shifts.png", "strips.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")
    text = str(done)
    assert text.splitlines()[0].startswith("success, constant")
    assert done.sentence in text and done.sentence in done._repr_html_()


def test_blind_policy_has_no_range():
    """In a task that flying straight on solves, too."""
    task = TaskSettings(
        num_cubes=1, first_distance=8.0, front_margin=4.0, cube_size=4.0, lateral_bound=0.5
    )
    blind = drone_rl.policy_from(
        lambda pictures: torch.tensor([1.0, 0.0, 0.0]).expand(len(pictures), 3), task=task
    )
    told = {**FEW, "domain_episodes": 400, "axes": ["noise", "object_size"]}
    found = drone_rl.shifts(blind, modes=["constant"], **told)
    assert found.plain.success.share == 1.0
    assert all(r.positions is None for r in found.domain.ranges.values())
    assert "no range" in found.sentence and "Good with" not in found.sentence


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"axes": ["wind"]}, "axes=wind is unknown; give some of: color"),
        ({"task": {"cube_size": -1.0}}, r"task\.cube_size=-1"),
    ],
)
def test_wrong_settings_are_refused_before_rendering(change, message, monkeypatch):
    monkeypatch.setattr("drone_rl.sim.worlds.Worlds.render", None)
    with pytest.raises(InputError, match=message):
        drone_rl.shifts("good", **{**FEW, **change})


def test_task_without_an_oracle_has_absolute_thresholds(monkeypatch):
    none = property(lambda _: None, lambda _, value: None)
    monkeypatch.setattr(CollectCubes, "oracle", none)
    found = drone_rl.shifts("good", **{**FEW, "axes": ["noise"], "modes": ["constant"]})
    assert found.plain.oracle is None and found.axes["noise"].levels[0].impossible is None
    assert found.domain.is_absolute and "no usable oracle" in found.sentence
    assert (
        found.domain.ranges["noise"].test is None
        or found.domain.ranges["noise"].test.required == 0.9
    )


def test_derived_task_is_refused():
    class Strict(CollectCubes):
        name = "strict"

    policy = drone_rl.policy_from(
        lambda x: torch.tensor([9.0, 0.0, 0.0]).expand(len(x), 3),
        task=Strict(TaskSettings(num_cubes=1)),
    )
    with pytest.raises(InputError, match="no settings to perturb"):
        drone_rl.shifts(policy, axes=["noise"], domain=False, **FEW)
