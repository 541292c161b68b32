"""Which flights under other conditions are found, and which are not believed."""

import json
import os
import shutil

import numpy as np
import pytest

import drone_rl
from drone_rl.config.commands import JudgeSettings
from drone_rl.policies.zoo import shifts_path
from drone_rl.trust.axes import AXES, find_axes
from drone_rl.trust.coverage import check_required, find_domain, read_requirements, required_span
from drone_rl.trust.paired_evaluation import EvaluatedPolicy
from drone_rl.trust.shifts_results import Need, Robustness
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import RootSeed
from tests.evidence import SHIFTS, changed
from tests.trust.making import shifts_of


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


FEW = JudgeSettings(domain_flights=40)
SEED = RootSeed(3, True)


@pytest.fixture(scope="module")
def near():
    """A good policy in short episodes."""
    return drone_rl.load_policy("good").in_task(num_cubes=1)


@pytest.fixture
def require(tmp_path):
    def check(policy, text, settings=FEW):
        (tmp_path / "needs.yaml").write_text(text)
        return check_required(policy, tmp_path / "needs.yaml", settings, SEED)

    return check


def test_required_ranges_are_tested_together(near, require):
    found = require(near, "blur: {high: 0.5, unit: pixels}\nfog: {low: 100, unit: m of sight}")
    assert found.is_covered and found.test.success.trials == 40
    assert str(found).startswith("covered: 100% (95% CI 91.2% to 100%) over blur and fog together")
    words = (
        "it fails in at most 8.9% of episodes at such strengths (95% confidence). Fixed seed 3: a"
    )
    assert words in str(found)


def test_a_range_in_which_the_policy_fails_is_not_covered(near, require):
    found = require(near, "dead_rows: {low: 10, high: 12, unit: rows}")
    assert not found.is_covered
    assert {values["dead_rows"] for values in found.test.failed} <= {10.0, 11.0, 12.0}
    assert "90.0% has to be exceeded; it fails at dead_rows=1" in str(found)


def test_a_required_domain_of_a_callable_is_tested(near, require):
    network = near.make_network()
    policy = drone_rl.policy_from(network, task=near.task)
    assert require(policy, "blur: {high: 0.5, unit: pixels}").is_covered


def test_no_episodes_cover_nothing(near, require):
    found = require(near, "blur: {high: 1, unit: pixels}", JudgeSettings(domain_flights=0))
    assert not found.is_covered and "no episodes tested it" in str(found)


def test_verdict_with_a_required_domain(near, tmp_path):
    (tmp_path / "needs.yaml").write_text("blur: {high: 0.5, unit: pixels}")
    told = {"require_domain": tmp_path / "needs.yaml", "progress": silent, "domain_flights": 40}
    done = drone_rl.judge(near, episodes=5, sampled=False, **told)
    assert done.required_domain.is_covered and "\ncovered: " in str(done)
    assert done.as_dict()["required_domain"]["needs"]["blur"]["high"] == 0.5
    strict = drone_rl.judge(near, episodes=5, sampled=False, good_share=0.99, **told)
    assert not strict.required_domain.is_covered and strict.status() == 17
    with pytest.raises(InputError, match="policy=left has no network"):
        drone_rl.judge("left", **told)


@pytest.mark.parametrize("name", list(AXES))
def test_sampled_strengths_are_within_the_required_range(near, name):
    of = EvaluatedPolicy.of(near)
    (axis,) = find_axes([name], of)
    value, neutral = (axis.value(s, of) for s in (axis.strengths[1], axis.neutral))
    low, high = sorted((value, neutral))
    span = required_span(axis, Need(**{"low" if value < neutral else "high": value}, unit=""), of)
    rng = np.random.default_rng(0)
    values = [axis.value(axis.sample(*span, rng), of) for _ in range(20)]
    assert all(low - 1e-9 <= one <= high + 1e-9 for one in values)
    assert len({*values}) > 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sun: {high: 50, unit: degrees}", "elevation of the sun: low is missing .* give low, too"),
        ("sun: {low: 70, unit: degrees}", "elevation of the sun: high is missing .* but low is 70"),
    ],
)
def test_requirements_that_do_not_fit_the_policy(require, text, message):
    with pytest.raises(InputError, match=rf"require_domain=.*needs.yaml: .*{message}"):
        require(drone_rl.load_policy("good"), text)


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


def need(unit="", **ends):
    return Need(unit=unit, **ends)


def test_domain_files_are_valid_requirements(read):
    ranges = Robustness.read(SHIFTS).requirements()
    assert ranges["sun"] == {"low": 21.07, "high": 60.0, "unit": "degrees"}
    read(json.dumps(ranges), "domain.json")
    bad = {"domain.ranges.sun.positions": None, "axes.blur.levels.1.modes.constant.unchanged": True}
    assert [*Robustness.read(changed(SHIFTS, bad)).requirements()] == ["brightness"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{}", "is empty; give axes"),
        ("wind: {low: 1, unit: m/s}", "axis='wind': it must be 'object_color'"),
        ("fog: 60", "fog=60: .*; give low, high or both, and unit: m of sight"),
        ("fog: {low: 60, unit: km}", "fog.unit=km must be m of sight"),
        (
            "fog: {low: 60, high: 40, unit: m of sight}",
            r"\[60.0, 40.0\] must be one or two",
        ),
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
