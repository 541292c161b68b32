import torch

from drone_rl.sim.dynamics.state import GROUND, NOTHING, Contact
from drone_rl.sim.sensors import suite


def contact(things, times):
    """Return contacts at distinct positions."""
    count = len(things)
    numbers = torch.arange(1.0, count + 1, dtype=torch.float64)
    up = torch.tensor([[0.0, 0.0, 1.0]], dtype=torch.float64).repeat(count, 1)
    time = torch.tensor(times, dtype=torch.float64)
    return Contact(torch.tensor(things), up, up * numbers[:, None], 0.01 * numbers, time)


def place(x):
    return torch.full((2, 3), float(x), dtype=torch.float64)


def test_collision_is_kept_until_it_is_read():
    state = suite.start_collisions(place(0))
    assert state.has_collided.tolist() == [False, False]
    state = suite.update_collisions(state, contact([NOTHING] * 2, [0.0] * 2), place(1))
    assert state.has_collided.tolist() == [False, False]
    touched = contact([NOTHING, 3], [0.0, 0.5])
    state = suite.update_collisions(state, touched, place(2))
    state = suite.update_collisions(state, touched, place(3))
    assert state.has_collided.tolist() == [False, True]
    collision, state = suite.read_collisions(state)
    assert collision.has_collided.tolist() == [False, True]
    assert collision.contact.thing.tolist() == [NOTHING, 3]
    assert collision.contact.normal[1].tolist() == [0.0, 0.0, 1.0]
    assert collision.contact.point[1].tolist() == [0.0, 0.0, 2.0]
    assert collision.contact.depth[1].item() == 0.02
    assert collision.contact.time[1].item() == 0.5
    assert collision.position[1].tolist() == [2.0, 2.0, 2.0]
    again, state = suite.read_collisions(state)
    assert again.has_collided.tolist() == [False, False]
    assert again.contact.thing.tolist() == [NOTHING, 3]
    state = suite.update_collisions(state, touched, place(4))
    assert state.has_collided.tolist() == [False, False]


def test_later_contact_with_the_same_object_is_new():
    state = suite.update_collisions(
        suite.start_collisions(place(0)), contact([GROUND] * 2, [0.0] * 2), place(1)
    )
    _, state = suite.read_collisions(state)
    state = suite.update_collisions(state, contact([GROUND] * 2, [0.0, 0.003]), place(2))
    assert state.has_collided.tolist() == [False, True]
    assert state.position[:, 0].tolist() == [1.0, 2.0]


def test_collisions_are_read_per_drone():
    state = suite.update_collisions(
        suite.start_collisions(place(0)), contact([1, 2], [0.1] * 2), place(1)
    )
    collision, after = suite.read_collisions(state, torch.tensor([1]))
    assert collision.contact.thing.tolist() == [2]
    assert after.has_collided.tolist() == [True, False]
    assert state.has_collided.tolist() == [True, True]
