"""Which flights under other conditions are found, and which are not believed."""

import json
import math
import os
import shutil

import numpy as np
import pytest

import drone_rl
from drone_rl.config.commands import JudgeSettings
from drone_rl.policies.zoo import shifts_path
from drone_rl.trust.axes import AXES
from drone_rl.trust.coverage import (
    _strengths,
    find_domain,
    lacking,
    read_requirements,
    recheck_domain,
)
from drone_rl.trust.shifts_results import Need, Robustness
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import RootSeed
from tests.evidence import SHIFTS, changed
from tests.trust.making import shifts_of, subject_of


@pytest.fixture
def good(tmp_path):
    """A policy in a file of its own."""
    path = tmp_path / "mine.safetensors"
    shutil.copy(drone_rl.load_policy("good").path, path)
    return drone_rl.load_policy(path)


def leave(folder, made, when=0):
    folder.mkdir(parents=True)
    path = folder / "shifts.json"
    path.write_text(made.model_dump_json())
    os.utime(path, (when, when))
    return path


def test_no_domain(good, tmp_path):
    assert find_domain(good, outputs=tmp_path) is None


def test_file_next_to_the_policy_comes_first(good, tmp_path):
    made = shifts_of(good)
    leave(tmp_path / "shifts" / "runs" / "a", made)
    made.write_json(shifts_path(good.path))
    assert find_domain(good, outputs=tmp_path).path == str(tmp_path / "mine.shifts.json")
    other = find_domain(good.in_task(num_cubes=2), outputs=tmp_path)
    assert other.shifts is None and "of another task" in other.refused


def test_newest_file_of_the_policy_with_ranges(good, tmp_path):
    runs, made = tmp_path / "shifts" / "runs", shifts_of(good)
    leave(runs / "old", made, when=1)
    wanted = leave(runs / "newer", made, when=2)
    leave(runs / "without", made.replace(domain=None), when=3)
    leave(runs / "of_another", shifts_of(good, weights="0" * 64), when=4)
    assert find_domain(good, outputs=tmp_path).path == str(wanted)
    assert find_domain(good.in_task(num_cubes=2), outputs=tmp_path) is None
    assert find_domain(drone_rl.load_policy("poor"), outputs=tmp_path) is None


def test_given_file_must_be_of_the_policy(good, tmp_path):
    path = leave(tmp_path / "a", shifts_of(good))
    assert find_domain(good, path).path == str(path) == find_domain(good, path.parent).path
    with pytest.raises(InputError, match="of another task"):
        find_domain(good.in_task(num_cubes=2), path)
    foreign = drone_rl.policy_from(lambda pictures: pictures.flatten(1)[:, :3])
    assert find_domain(foreign, outputs=tmp_path) is None
    with pytest.raises(InputError, match="is not a drone_rl policy file"):
        find_domain(foreign, path)


def test_verdict_with_a_required_domain(good, tmp_path):
    """With few flights it is not certain, and lets it stand; a stricter one does not."""
    good = good.in_task(num_cubes=1)  # short episodes
    path = leave(tmp_path / "a", shifts_of(good))
    (tmp_path / "needs.yaml").write_text("blur: {high: 1.0, unit: pixels}")
    told = {"shifts": path, "require_domain": tmp_path / "needs.yaml", "progress": silent}
    told["domain_flights"] = 30
    done = drone_rl.judge(good, episodes=5, sampled=False, **told)
    (line,) = (one.text for one in done.findings if one.section == "shifts")
    assert done.required_domain.is_covered and "ood with blur of up to 1 pixels" in line
    assert f"see {path}, dated 1970-01-01 0" in line
    assert "re-checked by 30 episodes at each of 3 strengths" in str(done)
    assert len(str(done).splitlines()) == 5  # verdict, two findings, required domain, seed
    assert line in str(done) and line in done._repr_html_()
    assert done.as_dict()["required_domain"]["lacking"] == {}
    strict = drone_rl.judge(good, episodes=5, sampled=False, good_share=0.99, **told)
    assert not strict.required_domain.is_covered and "not quoted" in str(strict)
    unchecked = drone_rl.judge(good, episodes=5, sampled=False, **{**told, "domain_flights": 0})
    assert not unchecked.required_domain.is_covered
    assert "not covered: it requires 0.9" in str(strict)


def test_missing_domain_is_refused_before_any_episode(good, tmp_path, monkeypatch):
    monkeypatch.setattr("drone_rl.sim.worlds.Worlds.render", None)
    needs = tmp_path / "needs.yaml"
    needs.write_text("blur: {high: 1.0, unit: pixels}")
    told = {"require_domain": needs, "outputs": tmp_path, "progress": silent}
    with pytest.raises(InputError, match=r"no shifts.json; run drone-rl shifts policy=.*mine"):
        drone_rl.judge(good, **told)
    path = leave(tmp_path / "shifts" / "runs" / "a", shifts_of(good).replace(domain=None))
    with pytest.raises(InputError, match=r"has no ranges \(domain=false\); run drone-rl shifts"):
        drone_rl.judge(good, **told)
    shifts_path(good.path).write_text(path.read_text()[:-9])
    with pytest.raises(InputError, match="is damaged"):
        drone_rl.judge(good, **told)
    with pytest.raises(InputError, match="policy=left has no network"):
        drone_rl.judge("left", **told)


FEW = JudgeSettings(domain_flights=60)
SEED = RootSeed(3, True)


@pytest.fixture(scope="module")
def near():
    return drone_rl.load_policy("good").in_task(num_cubes=1)


def need(unit="", **ends):
    return Need(unit=unit, **ends)


def test_true_range_is_not_contradicted(near):
    found = recheck_domain(near, {"blur": need(high=0.5)}, shifts_of(near), FEW, SEED)
    assert found.contradictions == ()
    assert found.strengths["blur"][0] == 0.5 and len(found.strengths["blur"]) == 3
    assert all(0 < value < 0.5 for value in found.strengths["blur"][1:])
    assert "(fixed seed 3, to which a policy could have been fitted)" in str(found)
    assert "60 episodes at each of 3 strengths" in str(found)


def test_invented_range_is_contradicted(near):
    """Good, says the file, with twelve of 25 rows dead."""
    stated = shifts_of(near, axes=("dead_rows",))
    found = recheck_domain(near, {"dead_rows": need(low=12.0, high=12.0)}, stated, FEW, SEED)
    assert found.contradictions and all(
        line.startswith("dead rows at 12 rows: ") and "certainly not good there" in line
        for line in found.contradictions
    )


@pytest.mark.parametrize("name", list(AXES))
def test_rechecked_strengths_are_within_the_required_range(near, name):
    of, axis = subject_of(near), AXES[name]
    value = axis.value(axis.strengths[1], of)
    stated = shifts_of(near, axes=(name,))
    neutral = stated.axes[name].neutral
    neutral = math.inf if neutral is None else neutral
    wanted = need(low=value) if value < neutral else need(high=value)
    found = [*_strengths(axis, of, wanted, stated, np.random.default_rng(0))]
    values = [axis.value(strength, of) for strength in found]
    assert any(math.isclose(one, value) for one in values)
    low, high = sorted((value, neutral))
    assert all(low - 1e-9 <= one <= high + 1e-9 for one in values)
    assert len(found) == 3 or axis.whole


@pytest.fixture
def read(tmp_path):
    def build(text, name="needs.yaml"):
        (tmp_path / name).write_text(text)
        return read_requirements(tmp_path / name)

    return build


def test_requirements_in_yaml_and_json(read):
    needs = {
        "fog": need("m of sight", low=60.0),
        "sun": need("degrees", low=5.0, high=50.0),
    }
    text = "fog: {low: 60, unit: m of sight}\nsun: {low: 5, high: 50, unit: degrees}\n"
    assert read(text) == needs
    data = {"fog": {"low": 60, "unit": "m of sight"}}
    data["sun"] = {"low": 5, "high": 50, "unit": "degrees"}
    assert read(json.dumps(data), "needs.json") == needs


def test_domain_files_are_valid_requirements(read):
    ranges = Robustness.read(SHIFTS).requirements()
    assert ranges["sun"] == {"low": 21.07, "high": 60.0, "unit": "degrees"}
    read(json.dumps(ranges), "domain.json")
    bad = {"domain.ranges.sun.positions": None, "axes.blur.levels.1.modes.constant.unchanged": True}
    assert [*Robustness.read(changed(SHIFTS, bad)).requirements()] == ["brightness"]


def lacks(name, changes=None, **ends):
    return lacking(Robustness.read(changed(SHIFTS, changes or {})), name, need(**ends))


@pytest.mark.parametrize(
    ("name", "low", "high", "words"),
    [
        ("sun", 21.07, 60.0, None),
        ("sun", 30.0, None, None),
        ("sun", None, 60.0, None),
        ("sun", 21.0, None, "needed 21 to 55 degrees, good 21.07 to 60 degrees"),
        ("sun", 30.0, 61.0, "needed 30 to 61 degrees"),
        ("blur", None, 1.5, None),
        ("blur", None, 1.6, "needed 0 to 1.6 pixels, good 0 to 1.5 pixels"),
        ("brightness", 0.9, 1.0, "good 1 to 1 times"),
        ("fog", 60.0, None, "fog: not evaluated; run drone-rl shifts with axes=[fog]"),
    ],
)
def test_lacking_range(name, low, high, words):
    found = lacks(name, low=low, high=high)
    assert found == words if words is None else words in found


def test_single_end_beyond_the_unperturbed_value_is_refused():
    with pytest.raises(InputError, match=r"^elevation of the sun: low is missing .* give low, too"):
        lacks("sun", high=50.0)
    with pytest.raises(
        InputError, match=r"^elevation of the sun: high is missing .* but low is 70"
    ):
        lacks("sun", low=70.0)


def test_required_fog_has_no_upper_end():
    ranges = {"low": 80.0, "high": None, "positions": [0.0, 1 / 80]}  # from clear air
    fog = {**SHIFTS["axes"]["blur"], "neutral": None, "unit": "m of sight"}
    changes = {"axes.fog": fog, "domain.ranges.fog": ranges}
    assert lacks("fog", changes, low=80.0) is None
    words = "needed 60 and more m of sight, good 80 and more m of sight"
    assert words in lacks("fog", changes, low=60.0)
    clear = {**changes, "domain.ranges.fog.low": None, "domain.ranges.fog.positions": [0, 0]}
    words = "fog: needed 60 and more m of sight, good only without fog"
    assert lacks("fog", clear, low=60.0) == words


def test_untested_axes_cover_nothing():
    same = {"axes.blur.levels.1.modes.constant.unchanged": True}
    assert "not tested" in lacks("blur", same, high=1.0)
    nowhere = {"domain.ranges.blur.positions": None}
    assert "without perturbation" in lacks("blur", nowhere, high=1.0)
    end = {"end": "high", "good": False, "value": 2.0, "impossible": True}
    lost = {"domain.ranges.blur.failed": [end]}
    assert "impossible even for the oracle" in lacks("blur", lost, high=2.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty; the file was damaged"),
        ("{}", "is empty; give axes"),
        ("wind: {low: 1, unit: m/s}", "axis='wind': it must be 'object_color'"),
        ("fog: 60", "fog=60: .*; give low, high or both, and unit: m of sight"),
        ("fog: {low: 60, unit: km}", "fog.unit=km must be m of sight"),
        ("fog: {unit: m of sight}", r"fog: \[\] must be one or two rising numbers"),
        (
            "fog: {low: 60, high: 40, unit: m of sight}",
            r"\[60.0, 40.0\] must be one or two",
        ),
        ("fog: {low: 6, least: 60, unit: m of sight}", "fog.least is unknown"),
        ("fog: {low: sixty, unit: m of sight}", "fog.low='sixty'"),
        (
            "camera_yaw: {low: -5, high: 5, unit: degrees}",
            r"camera_yaw: \[-5.0, 5.0\] must be one or two rising numbers of 0 or more",
        ),
    ],
)
def test_wrong_requirements(read, text, message):
    with pytest.raises(InputError, match=message) as error:
        read(text)
    assert "\n" not in str(error.value) and "needs.yaml: " in str(error.value)


def test_missing_requirements(tmp_path):
    with pytest.raises(InputError, match=r"require_domain=.*none\.yaml can't be read"):
        read_requirements(tmp_path / "none.yaml")
