import pytest

from drone_rl.trust.shifts_text import NAMES, SHIFTS, inward, rows
from drone_rl.utils.text import said
from tests.evidence import SHIFTS as EVIDENCE
from tests.evidence import changed


def test_the_whole():
    text = said(SHIFTS, EVIDENCE)
    assert text["shifts.good"] == (
        "Good with the sun at 21.1 to 60 degrees (no more was tried) and blur of up to 1.5 pixels "
        "(95% confidence for each range)."
    )
    assert text["shifts.not"] == "Not with brightness at 0.8 times: cubes on its right 47.0%."
    assert text["shifts.impossible"].endswith("elevation of the sun at 0 degrees, 45.0%.")
    assert "succeeds in 1.5% of episodes" in text["shifts.together"]
    assert text["shifts.fixed_seed"].startswith("Fixed seed 0: ")
    said_too = ("good", "not", "impossible", "together", "scope", "fixed_seed")
    assert set(text) == {f"shifts.{name}" for name in said_too}


@pytest.mark.parametrize(
    ("value", "low", "high"),
    [
        (1.876, "1.88", "1.87"),
        (21.01, "21.1", "21"),
        (0.03125, "0.0313", "0.0312"),
        (60.0, "60", "60"),
        (0.0, "0", "0"),
        (155.04, "156", "155"),
    ],
)
def test_limits_are_rounded_to_where_it_is_surely_good(value, low, high):
    assert (inward(value, True), inward(value, False)) == (low, high)


def test_no_range_without_a_search_and_none_of_who_is_not_good():
    names = set(said(SHIFTS, changed(EVIDENCE, {"domain": None})))
    assert names == {"shifts.impossible", "shifts.together", "shifts.fixed_seed"}
    bad = {"low": None, "high": None, "positions": None, "failed": [], "low_open": None,
           "high_open": None}  # fmt: skip
    changes = {f"domain.ranges.{name}": bad for name in ("sun", "blur", "brightness")}
    text = said(SHIFTS, changed(EVIDENCE, {"domain.plain.good": False, **changes}))
    assert "no range" in text["shifts.none"]
    assert "good" not in " ".join(v for k, v in text.items() if k != "shifts.none").lower()


def test_an_axis_that_changes_nothing_is_claimed_nowhere():
    same = {"axes.blur.levels.1.modes.constant.unchanged": True}
    text = said(SHIFTS, changed(EVIDENCE, same))
    assert "blur" not in text["shifts.good"]
    assert text["shifts.untested"] == "Not tested, because without effect: blur."


def test_what_the_task_cannot_have():
    refused = {"bad": True, "good": False, "refused": "task.cube_size=9", "value": 9.0}
    refused |= {"end": "high", "oracle": None, "impossible": False}
    text = said(SHIFTS, changed(EVIDENCE, {"domain.ranges.brightness.failed": [refused]}))
    assert text["shifts.not"] == "Not with brightness at 9 times, which the task does not allow."


def test_fog_is_good_from_the_least_sight_up():
    fog = {"low": 85.06, "high": None, "positions": [0.0, 1 / 85.06], "flown": []}
    fog |= {"low_open": False, "high_open": None, "failed": []}
    changes = {"axes.fog": EVIDENCE["axes"]["blur"], "domain.ranges.fog": fog}
    assert (
        "fog with a visibility of 85.1 m or more ("
        in said(SHIFTS, changed(EVIDENCE, changes))["shifts.good"]
    )
    between = {**fog, "high": 100.0, "positions": [-0.01, 0.01], "high_open": True}
    text = said(SHIFTS, changed(EVIDENCE, {**changes, "domain.ranges.fog": between}))
    assert "fog with a visibility of 85.1 to 100 m (no more was tried)" in text["shifts.good"]


def test_all_at_once_names_the_axes():
    text = said(SHIFTS, EVIDENCE)["shifts.together"]
    assert text.startswith(
        "With elevation of the sun, blur and brightness at once, each at its third"
    )
    many = {f"axes.{name}": EVIDENCE["axes"]["blur"] for name in list(NAMES)[:8]}
    several = said(SHIFTS, changed(EVIDENCE, many))["shifts.together"]
    assert several.startswith("With all 11 axes of the table at once")


def test_the_table():
    head, sun, *_ = rows(EVIDENCE)
    assert head == ["success, constant", "1", "2", "3", "4", "5", "area", ""]
    assert sun == [
        "elevation of the sun",
        "60: 99.5%",
        "",
        "",
        "",
        "0: 10.0%*",
        "0.75",
        "degrees",
    ]
    refused = {"axes.sun.levels.0.refused": "task.cube_size=9", "axes.sun.areas.constant": None}
    assert rows(changed(EVIDENCE, refused))[1][1:7] == ["60: -", "", "", "", "0: 10.0%*", ""]


def test_what_nobody_can_is_not_the_policys_failure():
    failed = EVIDENCE["domain"]["ranges"]["brightness"]["failed"][0]
    failed = {**failed, "impossible": True, "oracle": {"share": 0.3}}
    text = said(SHIFTS, changed(EVIDENCE, {"domain.ranges.brightness.failed": [failed]}))
    assert "shifts.not" not in text and "shifts.uncertain" not in text
    assert "brightness at 0.8 times, 30.0%" in text["shifts.impossible"]
    end = {**failed, "end": "high", "value": 2.0}
    text = said(SHIFTS, changed(EVIDENCE, {"domain.ranges.blur.failed": [end]}))
    assert "blur of up to 1.5 pixels (no more is possible)" in text["shifts.good"]


def test_strengths_between_good_and_not_good_are_named_with_the_reason():
    dark = EVIDENCE["domain"]["ranges"]["brightness"]["failed"][0]
    near = {**dark, "bad": False, "success": 0.945}
    end = {**near, "end": "high", "value": 2.0, "success": 1.0, "fragile": 31}
    changes = {"domain.ranges.brightness.failed": [near], "domain.ranges.blur.failed": [end]}
    text = said(SHIFTS, changed(EVIDENCE, changes))
    assert text["shifts.uncertain"] == (
        "Not certain, in 400 episodes, whether it is good with blur at 2 pixels (100% succeed; "
        "rounding can change 31) or brightness at 0.8 times (94.5% succeed)."
    )
    assert "shifts.not" not in text and "blur of up to 1.5 pixels" in text["shifts.good"]


def test_camera_faults_of_the_training_are_named():
    seen = {"transforms": [{"name": "gray"}, {"name": "late_frames", "frames": 2}]}
    text = said(SHIFTS, {**EVIDENCE, "network": {"description": seen}})
    assert text["shifts.own_faults"] == "Without the camera faults of its training (late_frames)."


def test_an_axis_of_which_all_strengths_are_refused_is_not_called_without_effect():
    count = len(EVIDENCE["axes"]["blur"]["levels"])
    refused = {f"axes.blur.levels.{i}.refused": "camera.horizontal_fov=180" for i in range(count)}
    text = said(SHIFTS, changed(EVIDENCE, refused))["shifts.untested"]
    assert text == "Not tested, because no strength is allowed: blur."
