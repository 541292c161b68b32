from types import SimpleNamespace

import numpy as np
import torch

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.actions import MOVES
from drone_rl.trust.agents import StepContext
from drone_rl.trust.axes import AXES
from drone_rl.trust.paired_evaluation import PairedEvaluator
from drone_rl.trust.suite import STEP, FrameRecorder, make_strip
from tests.trust.subjects import Blind, subject


def test_the_picture_is_the_one_of_that_step():
    agent, shown = FrameRecorder(), iter(torch.arange(0, 200, 10, dtype=torch.uint8))

    class Marked:
        active = torch.arange(1)
        worlds = SimpleNamespace(dynamics=SimpleNamespace(actions=MOVES))

        def render(self, modality):
            assert modality == "rgb"
            return next(shown).expand(1, 2, 3, 3)

        def apply_faults(self, pictures, active):
            return pictures

    sight: StepContext = Marked()  # pyright: ignore[reportAssignmentType]
    for _ in range(STEP + 4):
        action, _ = agent.act(sight)
        assert action.tolist() == [0]
    assert agent.image.shape == (2, 3, 3) and set(agent.image.unique().tolist()) == {10 * STEP}


def test_a_strip_shows_every_strength():
    evaluator = PairedEvaluator(subject(Blind(0), TaskSettings(), camera=CameraSettings()), 1)
    for name in ("brightness", "late_frames", "object_size"):
        pictures = make_strip(evaluator, AXES[name])
        assert [p.shape for p in pictures] == [(25, 64, 3)] * 6
        assert not np.array_equal(pictures[0], pictures[-1])
    dark = make_strip(evaluator, AXES["brightness"])[-1]
    assert dark.max() < 40
    evaluator.close()


def test_what_cannot_be_has_no_picture():
    wide = subject(Blind(0))
    wide = type(wide)(
        wide.network, wide.task, wide.camera.replace(horizontal_fov=165.0), wide.transforms
    )
    evaluator = PairedEvaluator(wide, 1)
    shown = [picture is not None for picture in make_strip(evaluator, AXES["field_of_view"])]
    evaluator.close()
    assert shown == [True, True, False, True, False, True]  # 175 and 185 degrees are too wide
