"""The server: refusals, slow pages, wrong messages, and flights through the page's protocol."""

import contextlib
import json
import socket
import threading
import time
import urllib.error
import urllib.request

import pytest

import drone_rl
from drone_rl.flight.fly_page import server
from drone_rl.utils.errors import InputError
from tests.flight.fly_page.conftest import decode

client = pytest.importorskip("websockets.sync.client")
exceptions = pytest.importorskip("websockets.exceptions")


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = str(tmp_path_factory.mktemp("demonstrations"))
    with drone_rl.fly("good", saliency=False, demonstrations=folder) as opened:
        yield opened


def origin_of(page):
    return "/".join(page.url.split("/")[:3])


@contextlib.contextmanager
def connected(page, **changes):
    """Open a socket as a browser does; return it and the first message."""
    options = {"origin": origin_of(page), "max_size": 2**20, **changes}
    url = page.url.replace("http", "ws") + "socket"
    with client.connect(url, **options) as opened:
        yield opened, json.loads(opened.recv(timeout=20))


def send(opened, **message):
    opened.send(json.dumps(message))


def frames(opened):
    """Yield states and images for ever, and acknowledge each."""
    while True:
        message = opened.recv(timeout=20)
        if isinstance(message, str):
            yield json.loads(message), {}
            continue
        send(opened, type="ack")
        yield decode(message)


def wait_for(opened, condition, limit=400):
    for _, (state, _) in zip(range(limit), frames(opened), strict=False):
        if condition(state):
            return state
    raise AssertionError("this never happened")


def fetch(url, **headers):
    request = urllib.request.Request(url, headers=headers)
    with urllib.request.urlopen(request, timeout=20) as answer:
        return answer.status, answer.headers, answer.read()


@pytest.mark.parametrize(
    ("name", "kind", "part"),
    [
        ("", "text/html", b">Fly a drone</h1>"),
        ("fly.js", "text/javascript", b"requestAnimationFrame"),
        ("fly.css", "text/css", b"prefers-color-scheme: dark"),
    ],
)
def test_the_page_and_its_files_need_no_other_server(page, name, kind, part):
    status, headers, content = fetch(page.url + name)
    assert status == 200 and part in content
    assert headers["Content-Type"].startswith(kind)
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert headers["Referrer-Policy"] == "no-referrer"
    assert b"http://" not in content and b"https://" not in content


def test_it_listens_at_this_machine_alone_under_a_random_token(page):
    assert page.url.startswith("http://127.0.0.1:")
    assert len(page.url.split("/")[3]) >= 32
    with drone_rl.fly("good", saliency=False) as other:
        assert other.url.split("/")[3] != page.url.split("/")[3]


@pytest.mark.parametrize("path", ["", "socket", "x/", "x/fly.js", "../etc/passwd", "%2e%2e/"])
def test_without_the_token_everything_is_forbidden(page, path):
    with pytest.raises(urllib.error.HTTPError) as refused:
        fetch(f"{origin_of(page)}/{path}")
    assert refused.value.code == 403
    assert page.url.split("/")[3].encode() not in refused.value.read()


@pytest.mark.parametrize(
    "headers", [{"Host": "evil.example"}, {"Host": "127.0.0.1"}, {"Origin": "http://evil.example"}]
)
def test_other_hosts_and_origins_are_forbidden(page, headers):
    with pytest.raises(urllib.error.HTTPError) as refused:
        fetch(page.url, **headers)
    assert refused.value.code == 403


@pytest.mark.parametrize(
    "origin", [None, "http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1:1"]
)
def test_the_socket_is_for_the_page_alone(page, origin):
    with pytest.raises(exceptions.InvalidStatus) as refused, connected(page, origin=origin):
        pass
    assert refused.value.response.status_code == 403


def test_a_press_moves_the_drone(page):
    with connected(page) as (opened, hello):
        assert hello["texts"]["name"] == "good"
        send(opened, type="reset")
        send(opened, type="hold", controls=["forward"])
        send(opened, type="hold", controls=[])
        state = wait_for(opened, lambda s: s["position"][0] == 1.0)
        assert state["steps"] == 1


def test_a_wrong_message_is_answered_and_nothing_else_happens(page):
    with connected(page) as (opened, _):
        for text in ("no JSON", "[" * 3000, '{"type": "fly"}', '{"type": "reset", "x": NaN}'):
            opened.send(text)
            state = wait_for(opened, lambda s: "error" in s)
            assert "must be" in state["error"] or "is unknown" in state["error"]
        opened.send(b"\x00\xff")
        assert "error" in wait_for(opened, lambda s: "error" in s)
        assert "position" in wait_for(opened, lambda s: "position" in s)


def test_a_long_message_closes_the_socket(page):
    with connected(page) as (opened, _):
        opened.send("x" * (server.MAX_MESSAGE + 1))
        with pytest.raises(exceptions.ConnectionClosed):
            for _ in range(100):
                opened.recv(timeout=20)
    with connected(page) as (_, hello):
        assert hello["texts"]["name"] == "good"


def test_a_slow_page_gets_few_frames_and_the_newest(page):
    with connected(page) as (slow, _), connected(page) as (quick, _):
        first = [decode(slow.recv(timeout=20))[0] for _ in range(3)]
        seen = wait_for(quick, lambda s: s["frame"] > first[-1]["frame"] + 40)
        with pytest.raises(TimeoutError):
            slow.recv(timeout=0.3)  # three are not displayed yet
        send(slow, type="ack")
        late = decode(slow.recv(timeout=20))[0]
        assert late["frame"] >= seen["frame"]


def test_closing_a_page_lets_go_of_its_keys(page):
    with connected(page) as (opened, _):
        send(opened, type="reset")
        send(opened, type="hold", controls=["forward"])
        wait_for(opened, lambda s: s["position"][0] >= 2.0)
    with connected(page) as (opened, _):
        first = wait_for(opened, lambda s: True)
        later = wait_for(opened, lambda s: s["time"] > first["time"] + 1.0)
        assert later["position"] == first["position"]


def test_time_stands_still_without_a_page(page):
    with connected(page) as (opened, _):
        send(opened, type="pilot", pilot="policy")
        before = wait_for(opened, lambda s: s["pilot"] == "policy")["time"]
    time.sleep(1.0)
    with connected(page) as (opened, _):
        after = wait_for(opened, lambda s: True)["time"]
        send(opened, type="pilot", pilot="person")
        wait_for(opened, lambda s: s["pilot"] == "person")
    assert after - before < 0.6


def test_a_port_in_use_is_one_line():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(
            InputError, match=f"port={port} of .* can't be opened .*, such as port=0"
        ):
            drone_rl.fly("good", port=port)


def test_closing_ends_threads_and_frees_the_port(page):
    before = threading.active_count()
    with drone_rl.fly("good", saliency=False) as opened:
        port = int(opened.url.split(":")[2].split("/")[0])
        with connected(opened) as (talking, _):
            wait_for(talking, lambda s: True)
            opened.close()
            with pytest.raises(exceptions.ConnectionClosed):
                wait_for(talking, lambda s: False)
    assert threading.active_count() <= before
    with socket.socket() as again:
        assert again.connect_ex(("127.0.0.1", port)) != 0


def test_a_bug_in_the_simulation_ends_the_page_and_is_raised(monkeypatch):
    def fail(flight, seconds):
        raise RuntimeError("a bug")

    monkeypatch.setattr(server.Flight, "advance", fail)
    with drone_rl.fly("good", saliency=False) as opened, connected(opened) as (talking, _):
        with pytest.raises(exceptions.ConnectionClosed):
            wait_for(talking, lambda s: False)
        with pytest.raises(RuntimeError, match="a bug"):
            opened.wait()


def test_closing_a_page_leaves_the_keys_of_another_held(page):
    with connected(page) as (opened, _):
        with connected(page) as (other, _):
            send(other, type="hold", controls=[])
            send(other, type="set", name="light", value=0.9)
            wait_for(other, lambda s: s["settings"]["light"] == 0.9)
            send(opened, type="reset")
            send(opened, type="hold", controls=["forward"])
            wait_for(opened, lambda s: s["steps"] >= 1)
        begun = wait_for(opened, lambda s: s["steps"] >= 1)["steps"]
        wait_for(opened, lambda s: s["steps"] >= begun + 4)
