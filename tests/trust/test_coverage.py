"""Which flights under other conditions are found, and which are not believed."""

import json
import os
import shutil

import pytest

import drone_rl
from drone_rl.policies.zoo import shifts_path
from drone_rl.trust.coverage import compare_with_required, find_domain
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from tests.evidence import changed
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
    path.write_text(json.dumps(made))
    os.utime(path, (when, when))
    return path


def test_none_where_there_is_none(good, tmp_path):
    assert find_domain(good, outputs=tmp_path) is None


def test_what_lies_with_the_policy_comes_first(good, tmp_path):
    made = shifts_of(good)
    leave(tmp_path / "shifts" / "runs" / "a", made)
    shifts_path(good.path).write_text(json.dumps(made))
    assert find_domain(good, outputs=tmp_path).path == tmp_path / "mine.shifts.json"
    other = find_domain(good.in_task(num_cubes=2), outputs=tmp_path)
    assert other.numbers is None and "of another task" in other.refused


def test_the_newest_of_this_policy_with_ranges(good, tmp_path):
    runs, made = tmp_path / "shifts" / "runs", shifts_of(good)
    leave(runs / "old", made, when=1)
    wanted = leave(runs / "newer", made, when=2)
    leave(runs / "without", changed(made, {"domain": None}), when=3)
    leave(runs / "of_another", shifts_of(good, weights="0" * 64), when=4)
    assert find_domain(good, outputs=tmp_path).path == wanted
    assert find_domain(good.in_task(num_cubes=2), outputs=tmp_path) is None
    assert find_domain(drone_rl.load_policy("poor"), outputs=tmp_path) is None


def test_what_is_given_must_be_believed(good, tmp_path):
    path = leave(tmp_path / "a", shifts_of(good))
    assert find_domain(good, path).path == path == find_domain(good, path.parent).path
    with pytest.raises(InputError, match="of another task"):
        find_domain(good.in_task(num_cubes=2), path)
    foreign = drone_rl.policy_from(lambda pictures: pictures.flatten(1)[:, :3])
    assert find_domain(foreign, outputs=tmp_path) is None
    with pytest.raises(InputError, match="is not a drone_rl policy file"):
        find_domain(foreign, path)


@pytest.mark.parametrize(
    ("needs", "lacks"),
    [("blur: {high: 1.0, unit: pixels}", []), ("blur: {high: 1.1, unit: pixels}", ["blur"])],
)
def test_what_is_required_is_held_against_what_was_found(good, tmp_path, needs, lacks):
    (tmp_path / "needs.yaml").write_text(needs)
    measured = find_domain(good, leave(tmp_path / "a", shifts_of(good)))
    found = compare_with_required(good, tmp_path / "needs.yaml", measured)
    assert [*found.lacking] == lacks and found.is_stated == (not lacks)
    assert not found.is_covered  # nothing was flown to check it
    said = "blur: needed" if lacks else "the file states it, and no episodes re-checked it"
    assert str(found).startswith(f"not covered: {said}")


def test_a_verdict_tells_the_domain_and_may_speak_against_it(good, tmp_path):
    """With few flights it is not certain, and lets it stand; a stricter one does not."""
    good = good.in_task(num_cubes=1)  # short episodes
    path = leave(tmp_path / "a", shifts_of(good))
    (tmp_path / "needs.yaml").write_text("blur: {high: 1.0, unit: pixels}")
    told = {"shifts": path, "require_domain": tmp_path / "needs.yaml", "progress": silent}
    told["domain_flights"] = 30
    done = drone_rl.judge(good, episodes=5, sampled=False, **told)
    assert done.coverage.is_covered and "blur of up to 1 pixels" in done.domain
    assert done.domain.startswith(f"Read from {path}, dated 1970-01-01 0")
    assert "not measured again here: good with" in done.domain
    assert "re-checked by 30 episodes at each of 3 strengths" in str(done)
    assert len(str(done).splitlines()) == 4 and done.domain in done._repr_html_()
    assert done.as_dict()["required_domain"]["lacking"] == {}
    strict = drone_rl.judge(good, episodes=5, sampled=False, good_share=0.99, **told)
    assert not strict.coverage.is_covered and "not quoted" in strict.domain
    unchecked = drone_rl.judge(good, episodes=5, sampled=False, **{**told, "domain_flights": 0})
    assert not unchecked.coverage.is_covered
    assert "not covered: it requires 0.9" in str(strict)


def test_no_domain_and_no_network_are_told_before_anything_is_flown(good, tmp_path, monkeypatch):
    monkeypatch.setattr("drone_rl.sim.worlds.Worlds.render", None)
    needs = tmp_path / "needs.yaml"
    needs.write_text("blur: {high: 1.0, unit: pixels}")
    told = {"require_domain": needs, "outputs": tmp_path, "progress": silent}
    with pytest.raises(InputError, match=r"no shifts.json; run drone-rl shifts policy=.*mine"):
        drone_rl.judge(good, **told)
    path = leave(tmp_path / "shifts" / "runs" / "a", changed(shifts_of(good), {"domain": None}))
    with pytest.raises(InputError, match=r"has no ranges \(domain=false\); run drone-rl shifts"):
        drone_rl.judge(good, **told)
    shifts_path(good.path).write_text(path.read_text()[:-9])
    with pytest.raises(InputError, match="no plain JSON"):
        drone_rl.judge(good, **told)
    with pytest.raises(InputError, match="policy=left has no network"):
        drone_rl.judge("left", **told)
