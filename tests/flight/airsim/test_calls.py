"""Counts of calls, and remarks on those without their whole effect."""

from drone_rl.flight.airsim.calls import Calls, remark


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


def test_a_remark_outside_of_a_call_is_no_error():
    remark("nobody asks")
    assert str(Calls()) == "0 calls"


def test_names_that_a_client_makes_up_take_no_memory():
    calls = Calls()
    for i in range(2000):
        with calls.call("me", f"method_{i}"):
            remark("unknown")
    assert len(str(calls)) < 100_000
    assert str(calls).startswith("1000 calls")
