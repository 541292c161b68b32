"""Speed of the quadrotor simulation: measured work and keys of figures."""

import pytest
import torch

from benchmarks import flight_speed
from benchmarks.flight_speed import FLYING, Fleet, bench_flight_speed


def test_a_fleet_takes_random_moves():
    fleet = Fleet(4)
    assert fleet.actions.shape == (64, 4) and set(fleet.actions.unique().tolist()) == {0, 1, 2}
    assert flight_speed._fly(fleet) == 64 * 4
    assert fleet.body.ticks.tolist() == [64 * FLYING.control_ticks] * 4
    assert fleet.body.position[:, 2].tolist() == pytest.approx([2.5] * 4, abs=0.2)
    assert (fleet.body.position[:, :2].norm(dim=-1) > 1.0).all()
    assert torch.isfinite(fleet.body.numbers).all()


def test_mujoco_warp_takes_one_move_of_each_drone():
    assert FLYING.control_ticks == 33
    assert flight_speed._mujoco_warp_step(3)() == 3


def test_figures_by_name(monkeypatch):
    monkeypatch.setattr(flight_speed, "_DRONES", 4)
    monkeypatch.setattr(flight_speed, "_COLLECTED", (2,))
    monkeypatch.setattr(flight_speed, "rate", lambda work, seconds: 10.0 * work())
    monkeypatch.setattr(
        flight_speed, "paired", lambda one, other, **_: (one(), other(), one() / other())
    )
    found = bench_flight_speed(quick=True)
    assert found["flight_moves_per_s"] == 64 * 4
    assert found["flight_over_mujoco_warp"] == 64
    assert found["flight_realtime_factor"] == pytest.approx(10.0 * 33 * 0.003)
    assert found["flight_over_cv"] > 0 and found["flight_collector_fps"] > 0
