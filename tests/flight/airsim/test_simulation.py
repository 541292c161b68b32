"""Simulated time: periods, waits, pauses."""

import math

import pytest

from drone_rl.flight.airsim.messages import Pose, nanoseconds
from drone_rl.flight.airsim.methods import call
from drone_rl.flight.airsim.settings_file import parse_settings
from drone_rl.flight.airsim.simulation import Simulation, Wait
from drone_rl.flight.settings import ServeSettings


@pytest.fixture
def make():
    open_ones = []

    def build(text="{}", **settings):
        chosen = ServeSettings(scene="empty", **settings)
        open_ones.append(Simulation(parse_settings(text), chosen))
        return open_ones[-1]

    yield build
    for one in open_ones:
        one.close()


def test_lockstep_runs_while_a_call_waits_and_no_longer(make):
    simulation, answers = make(clock="lockstep"), []
    assert simulation.advance(1.0, math.inf) and simulation.time == 0.0
    simulation.wait_for(Wait(lambda: simulation.time >= 1.0, lambda: "done"), answers.append)
    assert not simulation.advance(60.0, 0.5)
    assert 0.5 <= simulation.time < 0.5 + simulation.period_s and answers == []
    assert simulation.advance(60.0, math.inf)
    assert answers == ["done"]
    assert 1.0 <= simulation.time < 1.0 + simulation.period_s
    assert not simulation.is_due


def test_time_stands_at_the_end_of_each_call(make):
    """The second call, which ends later, is answered by another `advance`."""
    simulation, answers = make(clock="lockstep"), []
    simulation.wait_for(Wait(lambda: simulation.time >= 0.2, lambda: "b"), answers.append)
    simulation.wait_for(Wait(lambda: simulation.time >= 0.1, lambda: "a"), answers.append)
    assert simulation.advance(60.0, math.inf) and answers == ["a"]
    assert simulation.time < 0.2 - simulation.period_s
    assert simulation.advance(60.0, math.inf) and answers == ["a", "b"]


def test_continue_for_a_time_pauses_afterwards(make):
    simulation, answers = make(clock="lockstep"), []
    simulation.pause(True)
    simulation.wait_for(simulation.continue_for(0.5), answers.append)
    assert simulation.is_blocked
    assert simulation.advance(60.0, math.inf)
    assert answers == [None] and simulation.is_paused
    assert simulation.time == pytest.approx(0.5, abs=simulation.period_s)


def test_time_stamps_of_vehicles_go_on_after_a_reset_and_from_their_creation(make):
    simulation = make(clock="lockstep")
    simulation.wait_for(simulation.continue_for(1.0), [].append)
    simulation.advance(60.0, math.inf)
    simulation.add_named("B", "simpleflight", Pose((0.0, 5.0, 0.0), (1.0, 0.0, 0.0, 0.0)))
    now = simulation.stamp
    assert now == 1_704_067_200_000_000_000 + nanoseconds(simulation.time)  # from 2024-01-01
    assert simulation.time >= 1.0
    assert simulation.find("B").multirotor_state()["timestamp"] == now
    simulation.reset()
    for vehicle in simulation.vehicles.values():
        assert vehicle.multirotor_state()["timestamp"] == now
        assert vehicle.rotor_states()["timestamp"] == now
    simulation.wait_for(simulation.continue_for(1.0), [].append)
    simulation.advance(60.0, math.inf)
    read = [call(simulation, f"get{kind}Data", [])["time_stamp"] for kind in ("Imu", "Barometer")]
    read.append(simulation.find("").collision()["time_stamp"])
    assert min(read) > now and max(read) <= simulation.stamp + 1000  # float32


@pytest.mark.parametrize("seconds", [0.01, 0.05, 0.1])
def test_continuing_keeps_the_remainder(make, seconds):
    """Ticks of 3 ms: no call takes as long as it says, but their sum does."""
    simulation = make(clock="lockstep")
    simulation.pause(True)
    for _ in range(40):
        answers = []
        simulation.wait_for(simulation.continue_for(seconds), answers.append)
        simulation.advance(60.0, math.inf)
        assert answers and simulation.is_paused
        simulation.pause(True)  # of a paused simulation: changes nothing
    assert simulation.time == pytest.approx(40 * seconds, abs=0.003)


def test_added_vehicles_have_the_heading_of_their_pose(make):
    """They look east, 90 degrees to the right."""
    simulation, half = make(), math.sqrt(0.5)
    east = Pose((0.0, 5.0, 0.0), (half, 0.0, 0.0, half))
    for kind in ("simpleflight", "computervision"):
        simulation.add_named(kind, kind, east)
        assert simulation.find(kind).pose.attitude == pytest.approx((half, 0.0, 0.0, half))
    simulation.add_named("C", "simpleflight", Pose((0.0, 9.0, 0.0), (math.nan,) * 4))
    assert simulation.find("C").pose.attitude == (1.0, 0.0, 0.0, 0.0)


def test_reset_keeps_the_time_and_drops_api_control(make):
    simulation = make(clock="lockstep")
    vehicle = simulation.find("")
    vehicle.enable_api_control(True)
    future, answers = vehicle.take_off(), []
    simulation.wait_for(Wait(lambda: future.done, future.result), answers.append)
    simulation.advance(0.0, math.inf)
    before = simulation.time
    simulation.reset()
    assert answers == [False]
    assert simulation.time == before and not vehicle.has_api_control


def test_multirotors_collide_with_each_other(make):
    """B hovers 3 m ahead of A, which flies into it at 2 m/s, and is pushed away."""
    text = '{"Vehicles": {"A": {"Z": -3, "AllowAPIAlways": true}, "B": {"X": 3, "Z": -3}}}'
    simulation = make(text, clock="lockstep")
    a, b = simulation.find("A"), simulation.find("B")
    future = a.move_by_velocity(2.0, 0.0, 0.0, 4.0)
    simulation.wait_for(Wait(lambda: future.done, future.result), [].append)
    simulation.advance(60.0, math.inf)
    seen = a.collision(), b.collision()
    assert [one["object_name"] for one in seen] == ["B", "A"]
    assert all(one["has_collided"] for one in seen)
    assert [one["normal"]["x_val"] for one in seen] == pytest.approx([-1.0, 1.0], abs=0.01)
    assert float(b.body.position[0, 0]) > 3.1
    apart = float((a.body.position - b.body.position).norm())
    assert apart >= 2 * a.settings.radius - 1e-6
    simulation.reset()
    start = a.pose
    beyond = Pose((9.0, 0.0, 0.0), start.attitude)
    simulation.teleport(a, beyond, ignore_collision=False)
    assert a.collision()["object_name"] == "B" and 2.3 < a.pose.position[0] <= 2.4
    assert b.collision()["object_name"] == "A"
    simulation.teleport(a, beyond, ignore_collision=True)
    assert a.pose.position[0] == 9.0 and not a.collision()["has_collided"]
