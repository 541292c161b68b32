import numpy as np
import pytest
import torch

from drone_rl.config.commands import JudgeSettings
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import (
    FRESH_BITS,
    RootSeed,
    Stream,
    fresh_seed,
    get_state,
    legacy_seed,
    plain_generator,
    root_seed,
    seed_sequence,
    set_state,
    side_stream,
    torch_generator,
    with_seed,
    world_random_state,
)


def draws(random_state):
    return tuple(random_state.uniform(size=4))


def test_streams_never_overlap():
    seen = {
        draws(world_random_state(seed, world, stream))
        for seed in range(4)
        for world in range(8)
        for stream in Stream
    }
    assert len(seen) == 4 * 8 * len(Stream)


def test_numbers_of_streams():
    assert {s.name: s.value for s in Stream} == {
        "WORLDS": 0,
        "POLICY_INIT": 1,
        "ACTIONS": 2,
        "CHOICE": 3,
        "REPORT": 4,
        "SEARCH": 5,
        "CRITIC_INIT": 6,
        "MINIBATCHES": 7,
        "CONFIRMATION": 8,
        "SHIFTED": 9,
        "SHIFTS": 10,
        "SENSORS": 11,
        "SCENES": 12,
        "CLONING": 13,
        "TORCH": 14,
    }
    drawn = world_random_state(7, 2).uniform()
    child = np.random.SeedSequence(7, spawn_key=(Stream.WORLDS, 2))
    assert drawn == np.random.RandomState(np.random.PCG64(child)).uniform()
    state = np.random.SeedSequence(7, spawn_key=(Stream.ACTIONS, 3)).generate_state(1, np.uint64)[0]
    expected = torch.rand(2, generator=torch.Generator().manual_seed(int(state) // 2))
    found = torch.rand(2, generator=torch_generator(7, Stream.ACTIONS, number=3))
    assert torch.equal(found, expected)
    default = torch_generator(7, Stream.ACTIONS).initial_seed()
    assert default == torch_generator(7, Stream.ACTIONS, number=0).initial_seed()


def test_state_round_trip():
    random_state = world_random_state(0, 0)
    random_state.uniform(size=7)
    state = get_state(random_state)
    expected = draws(random_state)
    other = world_random_state(9, 9)
    set_state(other, state)
    assert draws(other) == expected
    assert all(isinstance(v, int) for v in state.values())


def test_state_includes_the_kept_half_of_a_draw():
    """A 31-bit integer takes half of a 64-bit draw; the next one takes the other half."""
    random_state = world_random_state(0, 0)
    for _ in range(3):
        state = get_state(random_state)
        following = random_state.randint(2**31 - 1), random_state.uniform()
        for other in (random_state, world_random_state(9, 9)):
            set_state(other, state)
            assert (other.randint(2**31 - 1), other.uniform()) == following


@pytest.mark.parametrize("seed", [-1, 1.5, "0", None, True])
def test_bad_seed_is_refused(seed):
    with pytest.raises(InputError, match="whole number"):
        seed_sequence(seed)


def test_side_streams():
    world = world_random_state(3, 1)
    before = get_state(world)
    drawn = side_stream(world, 5).random(4)
    assert get_state(world) == before
    assert np.array_equal(side_stream(world, 5).random(4), drawn)
    other = world_random_state(0, 0)
    set_state(other, before)
    assert np.array_equal(side_stream(other, 5).random(4), drawn)
    world.uniform()
    others = [side_stream(s, *k) for s, k in [(world, (5,)), (other, (6,)), (other, (5, 0))]]
    assert not any(np.isin(stream.random(4), drawn).any() for stream in others)
    child = np.random.SeedSequence([before["state"], before["inc"]], spawn_key=(5,))
    assert np.array_equal(np.random.Generator(np.random.PCG64(child)).random(4), drawn)


def test_fresh_seeds_differ_and_are_exact_in_json():
    found = {fresh_seed() for _ in range(100)}
    assert len(found) == 100
    assert all(0 <= seed < 2**FRESH_BITS <= 2**53 for seed in found)
    assert max(found) > 2**40  # by chance less once in 2**800


def test_root_seed():
    assert root_seed(0) == RootSeed(0, is_fixed=True)
    assert not root_seed(None).is_fixed
    given, seed = with_seed(JudgeSettings(seed=7, episodes=3))
    assert (given.seed, given.episodes, seed) == (7, 3, RootSeed(7, is_fixed=True))
    open_, fresh = with_seed(JudgeSettings())
    assert open_.seed == fresh.value != with_seed(JudgeSettings())[1].value
    assert fresh.as_dict() == {"seed": fresh.value, "seed_is_fixed": False}


def test_with_seed_of_a_whole_analysis():
    whole = RootSeed(2**47, is_fixed=False)
    part, seed = with_seed(JudgeSettings(seed=3), whole)
    assert (part.seed, seed) == (2**47, whole)


def test_seeds_of_any_length_have_a_generator():
    one, long = (torch.rand(3, generator=plain_generator(seed)) for seed in (5, 2**64 + 5))
    assert torch.equal(one, torch.rand(3, generator=torch.Generator().manual_seed(5)))
    assert torch.equal(one, long)


def test_legacy_seed():
    assert [legacy_seed(s) for s in (0, 5, 2**32 - 1)] == [0, 5, 2**32 - 1]
    long = [legacy_seed(2**32 + i) for i in range(100)]
    assert len(set(long)) == 100
    assert max(long) < 2**32
