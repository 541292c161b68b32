"""Values on the wire: keys in order, frames by hand, and what is refused."""

import math
import time

import pytest
import torch

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.calls import Calls, remark
from drone_rl.flight.airsim.messages import MAX_NAME, Pose
from drone_rl.flight.airsim.patterns import matching
from drone_rl.utils.errors import InputError
from tests.flight.airsim.conftest import pose

HALF = math.sqrt(0.5)


def test_maps_have_the_keys_of_airsim_in_order():
    made = messages.pose(Pose((1, 2, 3), (1, 0, 0, 0)))
    assert [*made] == ["position", "orientation"]
    assert [*made["position"]] == ["x_val", "y_val", "z_val"]
    assert [*made["orientation"]] == ["w_val", "x_val", "y_val", "z_val"]
    assert made["position"] == {"x_val": 1.0, "y_val": 2.0, "z_val": 3.0}
    assert all(type(value) is float for value in made["position"].values())
    assert messages.geo_point((1, 2, 3)) == {"latitude": 1.0, "longitude": 2.0, "altitude": 3.0}
    assert messages.nanoseconds(1.5) == 1_500_000_000


def test_frames_by_hand():
    """Two metres to the left and three up are -2 east and -3 down."""
    assert messages.ned(torch.tensor([1.0, 2.0, 3.0])) == (1.0, -2.0, -3.0)
    assert messages.to_world((1.0, -2.0, -3.0)) == (1.0, 2.0, 3.0)
    # a quarter turn to the left, seen from above, is one of -90 degrees about the down axis
    left = torch.tensor([HALF, 0.0, 0.0, HALF])
    assert Pose.of(torch.zeros(3), left).attitude == pytest.approx((HALF, 0.0, 0.0, -HALF))
    back = messages.attitude_to_world([2 * HALF, 0.0, 0.0, -2 * HALF])
    torch.testing.assert_close(back.float(), left)


@pytest.mark.parametrize(
    ("read", "value", "message"),
    [
        (lambda v: messages.number(v, "x"), "1", "x='1' is not a number"),
        (lambda v: messages.whole(v, "n", 0, 9), 1.5, "n=1.5 is out of range; give 0 to 9"),
        (lambda v: messages.flag(v, "b"), "yes", "b='yes' is neither true nor false"),
        (lambda v: messages.text(v, "t"), 7, "t=7 is not a text"),
        (messages.read_pose, 7, "pose=7 is not a map"),
        (messages.read_pose, {"position": {}}, "pose.position.x_val=None is not a number"),
        (lambda v: messages.read_vector(v, "v"), {"x_val": 1, "y_val": 2}, "v.z_val=None"),
        (
            lambda v: messages.read_path(v, "path"),
            [{"x_val": 1, "y_val": 2, "z_val": math.nan}],
            r"path.z_val=nan",
        ),
        (messages.attitude_to_world, [0.0, 0.0, 0.0, 0.0], "is no rotation"),
        (lambda v: messages.read_yaw_mode(v, "yaw_mode"), {}, "yaw_mode.is_rate=None is neither"),
        (lambda v: messages.read_drivetrain(v, "drivetrain"), 2, "drivetrain=2 is out of range"),
    ],
)
def test_wrong_values_are_refused(read, value, message):
    with pytest.raises(InputError, match=message):
        read(value)


def test_numbers_are_limited():
    assert messages.number(2, "x", 0.0, 1.0) == 1.0
    assert messages.number(-math.inf, "x", 0.0, 1.0) == 0.0
    assert messages.read_pose(pose(2e6, 0.0, 0.0)).position == [1e6, 0.0, 0.0]


def test_dates():
    assert messages.read_date("1970-01-02") == 86400e9
    assert messages.read_date("1970-01-01T00:00:01.5+00:00") == 1.5e9
    for text in ("today", "1969-12-31"):
        with pytest.raises(InputError, match="date="):
            messages.read_date(text)


def test_old_clients_send_bytes():
    assert messages.text(b"fly", "t") == "fly"
    given = {b"x_val": 1, b"y_val": 2, b"z_val": 3}
    assert messages.read_vector(given, "v") == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    "pattern",
    [
        "(a+)+b",
        "a?a?a?a?a?a",
        "(.*|b)(.*|c)(.*|d)(.*|e)",
        "(?:a*)+",
    ],
)
def test_searches_that_could_take_forever_are_refused(pattern):
    with pytest.raises(InputError, match="repeats too much; give at most 3"):
        matching(pattern, ["a" * 100])


def test_the_slowest_search_that_is_allowed_ends():
    begin = time.monotonic()
    assert matching(".*.*.*b", ["a" * MAX_NAME] * 20) == []
    assert time.monotonic() - begin < 5.0


def test_calls_are_counted_and_remarks_are_logged_once(caplog):
    calls = Calls()
    for _ in range(3):
        with calls.call("me", "simSetWeatherParameter"):
            remark("no snow")
    with calls.call("me", "ping"):
        pass
    assert str(calls).splitlines() == [
        "4 calls: simSetWeatherParameter 3, ping 1",
        "without effect, or with a part of it:",
        "  3 x simSetWeatherParameter: no snow",
    ]
    assert [record.getMessage() for record in caplog.records] == [
        "me: simSetWeatherParameter: no snow"
    ]


def test_clients_write_no_lines_of_their_own(caplog):
    calls = Calls()
    with calls.call("me", "evil\n\x1b[31m"):
        remark("a\r\nb\u2028\ud800")
    expected = r"evil\n\x1b[31m: a\r\nb\u2028\ud800"
    assert [record.getMessage() for record in caplog.records] == [f"me: {expected}"]
    assert str(calls).splitlines() == [
        r"1 calls: evil\n\x1b[31m 1",
        "without effect, or with a part of it:",
        f"  1 x {expected}",
    ]
