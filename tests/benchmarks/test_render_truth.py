"""What counts as a difference, by pictures made by hand; and some scenes by OpenGL itself."""

import json
import subprocess
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import render_truth
from benchmarks.render_truth import Compared, compare, compare_scenes, summary
from drone_rl.utils.errors import InputError


def picture():
    """Geom 3 fills 8 x 8 pixels of 12 x 12, 4 m away, gray; it looks at the camera."""
    made = {
        "rgb": np.zeros((12, 12, 3), np.uint8),
        "depth": np.zeros((12, 12), np.float32),
        "segmentation": np.full((12, 12), -1, np.int32),
        "normals": np.zeros((12, 12, 3), np.float32),
    }
    inside = (slice(2, 10), slice(2, 10))
    made["rgb"][inside], made["depth"][inside] = 100, 4.0
    made["segmentation"][inside], made["normals"][inside] = 3, [-1.0, 0.0, 0.0]
    made["nudged"] = np.stack([made["segmentation"]] * 4)
    made["facets"] = np.zeros((12, 12))
    return made


def test_the_same_pictures_do_not_differ():
    assert compare(picture(), picture()) == Compared(0, (1.0,), 0.0, 0)


def test_another_geom_within_is_wrong_and_on_an_edge_is_not():
    theirs = picture()
    theirs["segmentation"][2, 5] = -1  # a pixel of the edge
    found = compare(picture(), theirs)
    assert found.inner_wrong == 0 and found.overlaps == (63 / 64,)
    theirs["segmentation"][4:9, 4:9] = 7  # another geom, of 3 x 3 pixels on no edge
    assert compare(picture(), theirs).inner_wrong == 9
    assert min(compare(picture(), theirs).overlaps) == (63 - 25) / 64  # 25 are too few to count


def test_where_opengls_rounding_decides_a_geom_need_not_overlap():
    ours, theirs = picture(), picture()
    theirs["segmentation"][2, 5:7] = -1
    ours["nudged"][3, 2, 5] = -1  # turned a little, ours has the same there
    assert compare(ours, theirs).overlaps == (62 / 63,)


def test_depth_differs_but_for_what_opengl_rounds():
    theirs = picture()
    theirs["depth"][5, 5] += 0.003
    rounding = 2 * 2.0**-24 * 16 / 0.02  # of 4 m, with the near end at 2 cm
    assert compare(picture(), theirs).depth_m == pytest.approx(0.003 - rounding, abs=1e-6)
    theirs["depth"][5, 5] = 4.0 + rounding / 2
    assert compare(picture(), theirs).depth_m == 0.0
    theirs["depth"][2, 2] = 9.0  # on an edge
    assert compare(picture(), theirs).depth_m == 0.0


def test_a_steep_surface_may_be_off_by_a_fraction_of_a_pixel():
    ours, theirs = picture(), picture()
    ours["depth"][2:10, 2:10] += np.arange(8) * 2.56  # 2.56 m a pixel: 10 mm in 1 / 256 of it
    theirs["depth"] = ours["depth"] + np.float32(0.012) * (ours["depth"] > 0)
    assert 0 < compare(ours, theirs).depth_m < 0.002 + 1e-6


def test_colours_differ_within_faces_only():
    ours, theirs = picture(), picture()
    theirs["rgb"][5, 5] = 103
    assert compare(ours, theirs).rgb == 3
    ours["normals"][5:10, 2:10] = [0.0, 1.0, 0.0]  # a crease runs through there
    assert compare(ours, theirs).rgb == 0


def test_what_opengl_cuts_off_because_it_is_near_is_left_out():
    ours, theirs = picture(), picture()
    ours["depth"][2:10, 2:10] = 0.01
    theirs["segmentation"][:] = -1
    assert compare(ours, theirs).inner_wrong == 0


def test_figures_over_scenes():
    compared = [Compared(0, (1.0, 0.99), 0.0001, 1), Compared(2, (0.97,), 0.0005, 2)]
    assert summary(compared) == {
        "render_truth_scenes": 2,
        "render_truth_inner_wrong": 2,
        "render_truth_geoms": 3,
        "render_truth_overlapping": 2,
        "render_truth_least_overlap": 0.97,
        "render_truth_depth_mm": 0.5,
        "render_truth_rgb": 2,
    }


@pytest.mark.parametrize("status", [0, 1])
def test_a_process_of_its_own_draws_by_opengl_or_says_why_not(monkeypatch, status):
    asked, found = [], {"render_truth_scenes": 50}

    def run(command, env, **kwargs):
        asked.append((command[-1], env["MUJOCO_GL"]))
        printed = f"noise\n{json.dumps(found)}\n"
        return SimpleNamespace(returncode=status, stdout=printed, stderr="Traceback\nno EGL\n")

    monkeypatch.setattr(subprocess, "run", run)
    if status == 0:
        assert render_truth.bench_render_truth(quick=True) == found
    else:
        with pytest.raises(InputError, match=r"needs OpenGL by EGL, which failed \(no EGL\)"):
            render_truth.bench_render_truth(quick=True)
    assert asked == [("50", "egl")]


@pytest.mark.render
def test_random_scenes_are_drawn_as_by_opengl(egl):
    figures = summary(compare_scenes(12, seed=1))
    assert figures["render_truth_inner_wrong"] == 0
    assert figures["render_truth_geoms"] > 40
    assert figures["render_truth_least_overlap"] >= 0.98
    assert figures["render_truth_depth_mm"] <= 1.0
    assert figures["render_truth_rgb"] <= 2
