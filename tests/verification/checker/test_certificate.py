"""Files of strangers: what is read, what is refused, and in which words."""

import numpy as np
import pytest

from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.utils.errors import InputError
from drone_rl.verification.checker import certificate as module
from drone_rl.verification.checker.certificate import parse_certificate, read_certificate


def test_a_certificate_is_read(one_sided, write):
    found = read_certificate(write(one_sided))
    won, lost = found.outcomes
    assert (won.end, won.collected, won.loops) == (EndReason.ALL_CUBES, (True,), False)
    assert lost.end == EndReason.FRONT_BOUNDARY and set(lost.steps) == {27, 28, 29}
    assert won.share == pytest.approx(0.6375, abs=2e-6)
    assert won.boxes.shape == (1, 1, 2) and won.boxes.dtype == np.float64
    assert (found.name, found.task.lateral_bound, found.finished) == (
        "right_and_forward",
        6.0,
        True,
    )
    assert [len(boxes) for boxes in found.groups] == [1, 1, 1]
    assert str(won) == "all_cubes, cubes collected: 1"
    assert str(lost) == "front_boundary, cubes collected: none"


def test_where_it_comes_from_may_be_told(one_sided):
    told = {"versions": {"torch": "2"}, "git_revision": None, "machine": {"cores": 2}}
    assert parse_certificate({**one_sided, **told}).finished


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (
            ["format"],
            "drone_rl policy",
            "its format is not .* give certificate.json of",
        ),
        (["format_version"], 2, "format_version=2"),
        (["certain"], True, "certain"),
        (["policy", "weights"], 5, "weights=5"),
        (["policy", "description", "camera"], {}, r"camera\.width is missing"),
        (["policy", "description", "task", "vertical_bound"], 1.0, r"vertical_bound=1\.0"),
        (["policy", "description", "task", "lateral_bound"], 0.0, r"lateral_bound=0\.0"),
        (["policy", "description", "task", "num_cubes"], 9, "num_cubes=9 is out of range"),
        (["outcomes", 0, "end"], "running", "end='running' is unknown"),
        (["outcomes", 0, "collected"], [True, True], "has 2 values; give 1"),
        (["outcomes", 0, "share"], 1.5, r"outcomes\[0\]\.share=1\.5"),
        (["outcomes", 0, "steps"], {"007": 0.1}, "'007' is not a number of steps"),
        (["outcomes", 0, "steps"], {"12": -0.1}, r"steps\.12=-0\.1"),
        (["outcomes", 0, "steps"], {"12": 0.0}, r"steps\.12=0\.0 is out of range; give .* above 0"),
        (["outcomes", 0, "steps"], [], "must be a mapping"),
        (["outcomes", 0, "boxes"], {}, "the wrong shape"),
        (["outcomes", 0, "boxes"], [[[1.0, 2.0, 3.0]]], "the wrong shape; give a list of boxes"),
        (["outcomes", 0, "boxes"], [[[1.0, True]]], "values other than numbers"),
        (["outcomes", 0, "boxes"], [[[1.0, float("inf")]]], "not finite"),
        (["outcomes", 0, "boxes"], [[[1.0, 1.0]]], r"boxes\[0\] is empty"),
        (["undecided", "boxes"], [[[2.0, 1.0]]], r"undecided\.boxes\[0\] is empty"),
        (["finished"], 1, "finished=1"),
        (["stated", "logit_gap"], -1.0, "logit_gap"),
    ],
)
def test_what_is_no_certificate_is_refused_in_one_line(one_sided, write, keys, value, message):
    part = one_sided
    for key in keys[:-1]:
        part = part[key]
    part[keys[-1]] = value
    with pytest.raises(InputError, match=message) as caught:
        parse_certificate(one_sided)
    assert "\n" not in str(caught.value)


def test_a_missing_claim_is_refused(one_sided):
    del one_sided["undecided"]["share"]
    with pytest.raises(InputError, match="share is missing"):
        parse_certificate(one_sided)


def test_sizes_are_bounded(one_sided, write, monkeypatch):
    path = write(one_sided)
    monkeypatch.setattr(module, "MAX_BOXES", 2)
    with pytest.raises(InputError, match="it has 3 boxes; give at most 2 for 1 cubes"):
        read_certificate(path)
    monkeypatch.setattr(module, "MAX_STEPS", 1)
    with pytest.raises(InputError, match="step counts; give at most 1"):
        read_certificate(path)
    monkeypatch.setattr(module, "CERTIFICATE_BYTES", 100)
    with pytest.raises(InputError, match="too large"):
        read_certificate(path)


@pytest.mark.parametrize("border", [5e-324, 2.0**-101, -(2.0**-101), 2.0**20 + 1])
def test_borders_need_no_more_bits_than_exact_sums_can_have(one_sided, border):
    low, high = sorted((border, 0.0))
    one_sided["outcomes"][0]["boxes"] = [[[low, high]]]
    with pytest.raises(InputError, match="contains a border whose magnitude"):
        parse_certificate(one_sided)


@pytest.mark.parametrize("content", [b"{", b"[]", b'{"share": NaN}', b'{"a": 1, "a": 2}'])
def test_damaged_files_are_refused(write, content):
    with pytest.raises(InputError, match=r"certificate .*json can't be used"):
        read_certificate(write(content))


def test_a_file_must_be_there(tmp_path):
    with pytest.raises(InputError, match="can't be read"):
        read_certificate(tmp_path / "none.json")
