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


def test_names_that_a_client_makes_up_take_no_memory():
    calls = Calls()
    for i in range(2000):
        with calls.call("me", f"method_{i}"):
            remark("unknown")
    assert len(str(calls)) < 100_000
    assert str(calls).startswith("1000 calls")
