import json

import pytest

import drone_rl
from benchmarks.evidence import changed
from drone_rl.robustness.axes import AXES
from drone_rl.robustness.perturbations import Mode
from drone_rl.robustness.shifts_file import read_shifts
from drone_rl.robustness.shifts_text import SHIFTS
from drone_rl.robustness.suite import success_area
from drone_rl.utils.errors import InputError
from drone_rl.utils.text import said
from tests.robustness.making import figures, share, shifts_of


@pytest.fixture(scope="module")
def good():
    return drone_rl.load_policy("good")


@pytest.fixture
def read(good, tmp_path):
    """Reads made-up flights, some of which are changed."""

    def build(changes=None, policy=good):
        path = tmp_path / "shifts.json"
        path.write_text(json.dumps(changed(shifts_of(good), changes or {})))
        return read_shifts(path, policy.description, policy.state["policy"])

    return build


def test_what_holds_together_is_read(read, good):
    found = read()
    assert found.has_ranges and found.refused is None
    assert found.evidence["domain"]["ranges"]["blur"]["high"] == 1.0
    camera = good.description.camera
    assert [one.shape for one in found.pictures["blur"]] == [(camera.height, camera.width, 3)] * 6
    assert "pictures" not in found.evidence


def test_without_ranges_there_is_no_domain(read):
    assert not read({"domain": None}).has_ranges


def test_of_another_network_or_task_it_is_refused(read, good):
    with pytest.raises(InputError, match="for a network with hash"):
        read(policy=drone_rl.load_policy("poor"))
    with pytest.raises(InputError, match="of another task"):
        read(policy=good.in_task(num_cubes=2))


_BLUR = "domain.ranges.blur"
_LEVEL = "axes.blur.levels.0"
_FIGURES = f"{_LEVEL}.modes.constant"
_WIDE = {f"{_BLUR}.high": 1.5, f"{_BLUR}.positions": [0.0, 1.5]}
_ALL_GOOD = {f"{_BLUR}.flown.3.good": True, **_WIDE}


@pytest.mark.parametrize(
    ("lie", "message"),
    [
        ({"format": "drone_rl certificate"}, "format='drone_rl certificate' is unknown"),
        ({"axes.blur.levels.0.value": 9.0}, "axes.blur has other strengths"),
        ({"axes.blur.unit": "m"}, "axes.blur has other strengths or units"),
        ({"axes.blur.neutral": 1.0}, "axes.blur has other strengths"),
        ({"axes.blur.levels.0.modes": {}}, "levels.0.modes are not those of settings"),
        ({"axes.blur.levels.0.modes.drifting": 3}, "drifting"),
        ({"settings.strengths": [1, 2]}, "other strengths than settings.strengths"),
        (
            {"settings.modes": ["constant", "onset"], f"{_LEVEL}.modes.drifting": figures()},
            "levels.0.modes are not those of settings",
        ),
        ({"settings.episodes": 1000}, "plain.oracle is of 200 episodes, not of 1000"),
        ({f"{_LEVEL}.oracle": share(300, 300)}, "oracle is of 300 episodes, not of 200"),
        ({f"{_LEVEL}.impossible": True}, "impossible does not follow from its oracle"),
        ({f"{_LEVEL}.oracle": share(150)}, "impossible does not follow from its oracle"),
        ({f"{_LEVEL}.refused": "no"}, "is refused, and has figures"),
        ({f"{_FIGURES}.success": share(300, 300)}, "success is of 300 episodes"),
        ({f"{_FIGURES}.success": share(199)}, "ends do not add up"),
        ({f"{_FIGURES}.success.lower95": 0.999}, "is not the interval's end of 200 of 200, 0.98"),
        ({f"{_FIGURES}.success.upper95": 0.99}, "is not the interval's end of 200 of 200, 1"),
        ({f"{_FIGURES}.ends.all_cubes": 100}, "ends do not add up"),
        ({f"{_FIGURES}.shares.all.mean": 0.99}, "shares"),
        ({f"{_FIGURES}.shares.left.count": 201}, "shares holds something else than means"),
        ({f"{_FIGURES}.shares.left.upper95": 0.3}, "shares holds something else than means"),
        (
            {f"{_FIGURES}.shares.left": {"mean": None, "lower95": 0.0, "upper95": 1.0, "count": 3}},
            "shares holds something else than means",
        ),
        ({f"{_FIGURES}.paired.lost": 3}, "paired: gained - lost is not the difference"),
        (
            {f"{_FIGURES}.paired": {"lost": 1, "gained": 1, "p": 1.0}},
            "paired: gained - lost is not the difference",
        ),
        ({f"{_FIGURES}.paired.p": 0.5}, "paired.p is not that of its counts"),
        ({f"{_FIGURES}.difference.mean": -0.1}, "difference is not that of its pairs"),
        ({f"{_FIGURES}.difference.lower95": 0.1}, "difference is not that of its pairs"),
        ({"axes.blur.areas.constant": 0.9}, "areas is not that of its shares"),
        ({"axes.blur.areas": {}}, "areas is not that of its shares"),
        ({"together.impossible": True}, "together.impossible does not follow"),
        ({"domain.plain.success": 0.9999}, "success is not a fraction of 400 episodes"),
        ({"domain.plain.bad": True}, "is good, but also bad or refused"),
        ({f"{_BLUR}.failed.0.good": True}, "is good, but also bad or refused"),
        ({f"{_BLUR}.failed.0.oracle": share(200)}, "oracle is of 200 episodes, not of 400"),
        ({f"{_BLUR}.failed.0.impossible": True}, "impossible does not follow from its oracle"),
        (
            {f"{_BLUR}.failed.0.impossible": True, f"{_BLUR}.failed.0.oracle": None},
            "impossible does not follow",
        ),
        ({"domain.plain.success": 0.0}, "domain.plain says good, and domain.plain counts 0%"),
        (
            {"axes.blur.levels.4.modes.constant.unchanged": True},
            "unchanged, although episodes were lost or gained",
        ),
        ({f"{_BLUR}.failed.0.value": 1.49}, "domain.ranges.blur contradicts"),
        (
            {f"{_LEVEL}.modes.constant": figures(150), "axes.blur.areas.constant": None},
            "areas is not",
        ),
        ({"plain.success.share": 0.9}, "share is not what was counted"),
        ({"plain.success.successes": 201}, "share is not what was counted"),
        ({f"{_BLUR}.high": 2.0}, "domain.ranges.blur contradicts"),
        (_WIDE, "domain.ranges.blur contradicts"),
        (_ALL_GOOD, "domain.ranges.blur contradicts"),
        ({**_ALL_GOOD, f"{_BLUR}.failed": [], f"{_BLUR}.high_open": True}, "contradicts"),
        ({f"{_BLUR}.flown.1.good": False}, "domain.ranges.blur contradicts"),
        ({f"{_BLUR}.flown.1.position": 9.0}, "domain.ranges.blur contradicts"),
        ({f"{_BLUR}.failed": []}, "domain.ranges.blur contradicts"),
        ({f"{_BLUR}.high_open": True}, "domain.ranges.blur contradicts"),
        ({"domain.plain.good": False}, "contradicts"),
        ({"axes": {}}, "domain.ranges.blur is of an axis that axes does not have; run drone-rl"),
        ({"settings.good_share": 2.0}, "good_share=2.0 is out of range"),
        ({"seed": 1}, "seed=1 is not settings.seed=0"),
        ({"settings.seed": None}, "seed=0 is not settings.seed=None"),
        ({"seed": -1}, "seed=-1 is out of range"),
        ({"seed_is_fixed": "no"}, "seed_is_fixed='no' is neither true nor false"),
        ({"pictures.blur.0": None}, "has no image without perturbation"),
        ({"pictures.blur.1": "AAAA"}, "is not an image of 25 rows"),
    ],
)
def test_what_does_not_go_together_is_refused(read, lie, message):
    with pytest.raises(InputError, match=message) as error:
        read(lie)
    assert "\n" not in str(error.value) and "shifts.json can't be used" in str(error.value)


def test_a_hole_that_was_left_out_is_missed(read):
    """Who leaves the strength out at which it failed has a range with a gap."""
    made = shifts_of(drone_rl.load_policy("good"))["domain"]["ranges"]["blur"]
    lie = {f"{_BLUR}.flown": [made["flown"][0], *made["flown"][2:]]}
    with pytest.raises(InputError, match="contradicts"):
        read(lie)


def test_counts_and_ranges_are_held_against_each_other(read, good):
    """The range says good at 0.5 pixels, and 150 of 200 episodes succeeded there."""
    lie = {f"{_LEVEL}.modes.constant": figures(150)}
    levels = changed(shifts_of(good), lie)["axes"]["blur"]["levels"]
    lie["axes.blur.areas.constant"] = success_area(levels, 1.0, Mode.CONSTANT)
    with pytest.raises(InputError, match=r"says good at 0\.5, and axes\.blur counts 75% there"):
        read(lie)


def test_a_strength_that_another_seed_draws_is_missed(read):
    """The strengths between those of the table follow from the seed, and are not to be chosen."""
    with pytest.raises(InputError, match="contradicts"):
        read({"settings.seed": 1, "seed": 1})


def fog_of(good):
    """Good down to 40 m of visibility, and the same with low and high exchanged."""
    made = shifts_of(good, axes=("fog",))
    found = made["domain"]["ranges"]["fog"]
    assert (found["low"], found["high"]) == (40.0, None)
    assert (found["low_open"], found["high_open"]) == (False, None)
    assert found["positions"] == [0.0, 1 / 40]
    assert [failed["end"] for failed in found["failed"]] == ["low"]
    swapped = {"low": None, "high": 40.0, "low_open": None, "high_open": False}
    first = {f"domain.ranges.fog.{key}": value for key, value in swapped.items()}
    return made, changed(made, {**first, "domain.ranges.fog.failed.0.end": "high"})


def test_ends_of_an_inverse_axis_and_other_formats(good, tmp_path):
    made, exchanged = fog_of(good)
    path = tmp_path / "shifts.json"
    path.write_text(json.dumps(made))
    found = read_shifts(path, good.description, good.state["policy"])
    assert found.numbers["domain"] == made["domain"]
    path.write_text(json.dumps(exchanged))
    with pytest.raises(InputError, match="contradicts"):
        read_shifts(path, good.description, good.state["policy"])
    for version in (1, 3):
        path.write_text(json.dumps({**made, "format_version": version}))
        with pytest.raises(InputError, match=f"format_version={version}"):
            read_shifts(path, good.description, good.state["policy"])


@pytest.mark.parametrize("broken", [3, {"ranges": 3}, {"ranges": {"fog": 3}}])
def test_a_damaged_first_format_gets_one_line(good, tmp_path, broken):
    path = tmp_path / "shifts.json"
    path.write_text(json.dumps({**fog_of(good)[1], "domain": broken}))
    with pytest.raises(InputError, match=r"shifts\.json can't be used"):
        read_shifts(path, good.description, good.state["policy"])


@pytest.mark.parametrize("name", list(AXES))
def test_every_axis_is_read_as_it_is_written(good, tmp_path, name):
    made = shifts_of(good, axes=(name,))
    path = tmp_path / "shifts.json"
    path.write_text(json.dumps(made))
    found = read_shifts(path, good.description, good.state["policy"]).numbers
    assert found["domain"]["ranges"][name]["positions"] == sorted(
        made["domain"]["ranges"][name]["positions"]
    )


def test_a_damaged_file_is_refused(good, tmp_path):
    path = tmp_path / "shifts.json"
    for content in ("{", "[]", "{}", '{"pictures": 3}'):
        path.write_text(content)
        with pytest.raises(InputError, match="can't be used"):
            read_shifts(path, good.description, good.state["policy"])


def test_a_file_of_version_0_1_has_a_fixed_seed(good, tmp_path):
    made = shifts_of(good)
    path = tmp_path / "shifts.json"
    del made["seed"]
    path.write_text(json.dumps(made))
    with pytest.raises(InputError, match="one of seed and seed_is_fixed"):
        read_shifts(path, good.description, good.state["policy"])
    del made["seed_is_fixed"]
    path.write_text(json.dumps(made))
    measured = read_shifts(path, good.description, good.state["policy"])
    assert said(SHIFTS, measured.evidence)["shifts.fixed_seed"].startswith("Fixed seed 0: ")


def test_no_text_of_the_file_is_quoted(read, good):
    lie = {f"{_BLUR}.failed.0.worst": {"side": "nowhere at all", "share": 0.5}}
    with pytest.raises(InputError, match=r"worst\.side='nowhere at all' is unknown"):
        read(lie)
    assert read({"terms.goal": "certified cube"}).numbers["terms"]["goal"] == "cube"
