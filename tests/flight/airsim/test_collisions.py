"""Which collisions are new, last and are kept; sweeps of a ball."""

import math

import pytest
import torch

from drone_rl.flight.airsim.collisions import GAP, CollisionRecord, Solids, VehicleCollision

ORIGIN, UP = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
PERIOD = 0.021


def contact(name, time, *, is_event=False):
    return VehicleCollision(name, ORIGIN, ORIGIN, UP, 0.0, time, is_event)


def names(read):
    found, is_new = read
    return found.name if is_new else None


def test_a_contact_that_lasts_is_new_once():
    record = CollisionRecord()
    for i in range(10):
        record.add(contact("Ground", i * PERIOD))
    assert names(record.read()) == "Ground"
    record.add(contact("Ground", 10 * PERIOD))
    found, is_new = record.read()
    assert (found.name, found.time, is_new) == ("Ground", 0.0, False)
    record.add(contact("Ground", 10 * PERIOD + 1.01 * GAP))
    assert names(record.read()) == "Ground"


def test_each_object_that_was_touched_is_read_once():
    record = CollisionRecord()
    for name in ("cube_0", "cube_1"):
        record.add(contact(name, 1.0, is_event=True))
    assert names(record.read(clear=False)) == "cube_0"
    assert [names(record.read()) for _ in range(3)] == ["cube_0", "cube_1", None]


def test_version_1_1_reads_events_and_what_is_touched_now():
    record = CollisionRecord()
    record.add(contact("Ground", 0.0))
    record.add(contact("cube_0", 0.0, is_event=True))
    assert [names(record.read_current(0.02)) for _ in range(3)] == ["cube_0", "Ground", "Ground"]
    assert names(record.read_current(0.02 + GAP)) is None
    record.add(contact("wall", 1.0))
    record.move([], 1.0)
    assert names(record.read_current(1.0)) is None


def test_a_move_ends_contacts_except_with_what_is_still_touched():
    record = CollisionRecord()
    for name in ("Ground", "wall"):
        record.add(contact(name, 0.0))
    record.move(["Ground"], GAP)
    while record.read()[1]:
        pass
    for name in ("Ground", "wall"):
        record.add(contact(name, GAP + PERIOD))
    assert [names(record.read()) for _ in range(2)] == ["wall", None]


def test_a_touched_cube_is_kept_at_takeoff_until_it_is_read():
    record = CollisionRecord()
    record.add(contact("Ground", 0.0))
    record.add(contact("cube_0", 0.0, is_event=True))
    record.forget()
    assert [names(record.read()) for _ in range(2)] == ["cube_0", None]


def solids(*rows):
    names, *parts = zip(*rows, strict=True)
    return Solids(names, *(torch.tensor(part, dtype=torch.float64) for part in parts))


def vector(*values):
    return torch.tensor(values, dtype=torch.float64)


def test_a_sweep_stops_before_the_first_solid():
    """A wall from x = 4 to 6, and a ball of 0.3 m at x = 2, 0.55 m aside of the second path."""
    both = solids(
        ("wall", (5.0, 0.0, 0.0), (1.0, 9.0, 9.0), 0.0),
        ("ball", (2.0, 1.0, 0.0), (0.0, 0.0, 0.0), 0.3),
    )
    place, (name, point) = both.sweep(vector(0, 0, 0), vector(10, 0, 0), 0.3)
    assert name == "wall" and point.tolist() == [4.0, 0.0, 0.0]
    assert 3.65 <= float(place[0]) <= 3.7
    place, (name, point) = both.sweep(vector(0, 0.45, 0), vector(10, 0.45, 0), 0.3)
    assert name == "ball"
    assert float((point - vector(2, 1, 0)).norm()) == pytest.approx(0.3)
    there = vector(3.0, -1.0, 0.1)
    assert both.sweep(vector(0, 0, 0), there, 0.3) == (there, None)


def test_a_sweep_leaves_what_it_starts_in_and_goes_no_deeper():
    floor = solids(("Ground", (0.0, 0.0, -5.0), (math.inf, math.inf, 5.0), 0.0))
    low, high = vector(0.0, 0.0, 0.2), vector(0.0, 0.0, 2.0)
    assert floor.sweep(low, high, 0.3)[1] is None
    assert floor.sweep(low, vector(9.0, 0.0, 0.2), 0.3)[1] is None
    assert floor.sweep(low, vector(9.0, 0.0, 0.1), 0.3)[1][0] == "Ground"


def test_a_wall_stops_a_sweep_of_any_length():
    wall = solids(("wall", (5e5, 0.0, 0.0), (0.1, 9.0, 9.0), 0.0))
    for length in (499_999.7, 1e6):
        place, hit = wall.sweep(vector(0, 0, 0), vector(length, 0, 0), 0.3)
        assert hit[0] == "wall" and float(place[0]) == pytest.approx(499_999.6, abs=0.02)
