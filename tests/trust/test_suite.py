"""A policy's flights under several conditions, with numbers worked out by hand."""

import numpy as np
import pytest

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.config.commands import MODES
from drone_rl.envs.fault_models import dead_rows
from drone_rl.trust.axes import AXES
from drone_rl.trust.paired_evaluation import PairedEvaluator
from drone_rl.trust.perturbations import Condition
from drone_rl.trust.suite import Suite, area, make_strip
from tests.trust.subjects import Blind, subject


def silent(text):
    pass


@pytest.fixture(scope="module")
def suite():
    evaluator = PairedEvaluator(subject(Blind(0)), 20)
    yield Suite(evaluator, MODES, 0.9)
    evaluator.close()


def test_the_area_under_a_curve_by_hand():
    assert area([0.0, 1.0, 3.0], [1.0, 0.5, 0.0]) == pytest.approx((0.75 + 0.5) / 3)
    assert area([-1.0, 0.0, 1.0], [0.0, 1.0, 1.0]) == pytest.approx(0.75)


def test_axis_by_strength(suite):
    found = suite.run([AXES["object_size"], AXES["object_color"]], [1, 5], silent)
    plain = found["plain"].success.share
    along = found["axes"]["object_size"]
    assert (along.group, along.unit, along.neutral) == ("object size", "m", 2.5)
    assert [level.number for level in along.levels] == [1, 5]
    assert [level.value for level in along.levels] == [2.25, 1.25]
    small = along.levels[1]
    assert set(small.modes) == {"constant", "onset"}  # a size does not drift
    figures = small.modes["constant"]
    assert figures.success.share < plain  # what is smaller is hit less often
    difference = figures.success.share - plain
    assert figures.difference.mean == pytest.approx(difference)
    shares = figures.shares
    assert set(shares) == {"all", "left", "ahead", "right"}
    assert shares["left"].mean == shares["right"].mean == 0.0 < shares["ahead"].mean
    assert sum(figures.ends.values()) == figures.success.trials == 20
    assert found["plain"].oracle.share == 1.0 and small.impossible is False
    drifting = found["axes"]["object_color"].levels[1].modes["drifting"]
    assert drifting.success.share == plain and not drifting.unchanged
    assert found["axes"]["object_color"].areas["constant"] == pytest.approx(plain)
    # a size of 3/4 at the third strength, which this policy minds, and colors, which it does not
    assert found["together"].modes["constant"].success.share <= plain


def test_unchanged_episodes_are_noticed(suite):
    level = suite.level(Condition())
    assert level.modes["constant"].unchanged
    assert level.modes["constant"].difference.mean == 0.0
    tinted = suite.level(AXES["object_color"].make(0.3, suite._evaluator.subject))
    assert not tinted.modes["constant"].unchanged


def test_impossible_condition(suite):
    level = suite.level(Condition(faults=(dead_rows(5),)))
    assert level.impossible and level.oracle.upper95 < 0.9


def test_refused_condition(suite):
    level = suite.level(Condition(task={"cube_size": 9.0}))
    assert level.refused.startswith("task.altitude=2.5") and level.modes == {}
    assert level.impossible is None


def test_strip_has_every_strength():
    evaluator = PairedEvaluator(subject(Blind(0), TaskSettings(), camera=CameraSettings()), 1)
    for name in ("brightness", "late_frames", "object_size"):
        pictures = make_strip(evaluator, AXES[name])
        assert [p.shape for p in pictures] == [(25, 64, 3)] * 6
        assert not np.array_equal(pictures[0], pictures[-1])
    dark = make_strip(evaluator, AXES["brightness"])[-1]
    assert dark.max() < 40
    evaluator.close()


def test_strip_without_refused_strengths():
    wide = subject(Blind(0))
    wide = type(wide)(
        wide.network, wide.task, wide.camera.replace(horizontal_fov=165.0), wide.inputs
    )
    evaluator = PairedEvaluator(wide, 1)
    shown = [picture is not None for picture in make_strip(evaluator, AXES["field_of_view"])]
    evaluator.close()
    assert shown == [True, True, False, True, False, True]  # 175 and 185 degrees are too wide
