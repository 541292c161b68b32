"""A proof that is stopped and gone on with ends as one that never was."""

import numpy as np
import pytest

import drone_rl
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.policy_spec import make_policy_spec
from drone_rl.verification.prover.proof_files import load, save
from drone_rl.verification.prover.prover import Prover


@pytest.fixture(scope="module")
def spec():
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1)
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    yield spec
    spec.close()


@pytest.fixture(scope="module")
def narrow():
    """A small task, so that a proof in parts of 100 combinations has two of them."""
    policy = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1, lateral_bound=1.0)
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    yield spec
    spec.close()


@pytest.fixture(scope="module")
def uninterrupted(spec):
    return finish(Prover(spec))


@pytest.fixture(scope="module")
def uninterrupted_parts(narrow):
    return finish(Prover(narrow, 100))


def finish(prover):
    while not prover.is_finished:
        prover.advance()
    found = prover.findings()
    endings = {e: sorted(b.tolist()) for e, b in found.endings.items()}
    return endings, found.steps, sorted(found.undecided.tolist()), prover.num_states


@pytest.mark.parametrize("places", [3, 40])
def test_stopped_and_gone_on_with(spec, uninterrupted, tmp_path, places):
    path = tmp_path / "state.npz"
    stopped = Prover(spec)
    for _ in range(places):
        stopped.advance()
    save(stopped, path, "this")
    later = Prover(spec)
    load(later, path, "this")
    assert later.decided == stopped.decided
    assert finish(later) == uninterrupted


@pytest.mark.parametrize("places", [5, None])
def test_stopped_within_a_part_or_between_two(narrow, uninterrupted_parts, tmp_path, places):
    path, stopped, later = tmp_path / "state.npz", *(Prover(narrow, 100) for _ in range(2))
    assert len(stopped.parts) == 2
    stopped.advance()
    while stopped.waiting and stopped.num_states != places:
        stopped.advance()
    assert len(stopped.parts) == 1 and bool(stopped.waiting) == bool(places)
    save(stopped, path, "this")
    load(later, path, "this")
    assert len(later.parts) == 1 and later.boxes_under_way == stopped.boxes_under_way
    assert finish(later) == uninterrupted_parts


def test_another_proofs_state_is_refused(spec, tmp_path):
    path = tmp_path / "state.npz"
    save(Prover(spec), path, "this")
    with pytest.raises(InputError, match="belongs to another proof; delete it"):
        load(Prover(spec), path, "that")


@pytest.mark.parametrize("content", [b"no archive", b"PK\x03\x04 cut short"])
def test_a_broken_state_is_refused(spec, tmp_path, content):
    path = tmp_path / "state.npz"
    path.write_bytes(content)
    with pytest.raises(InputError, match="is not a saved proof state"):
        load(Prover(spec), path, "this")


def test_a_state_reached_by_no_action_is_refused(spec, tmp_path):
    path, begun = tmp_path / "state.npz", Prover(spec)
    begun.advance()
    save(begun, path, "this")
    with np.load(path) as arrays:
        state = {**arrays}
    state["waiting_rows"][:, 4] = 3
    np.savez(path, **state)
    with pytest.raises(InputError, match=r"is not a saved proof state .*by action 3"):
        load(Prover(spec), path, "this")


def test_a_state_with_code_in_it_is_refused(spec, tmp_path):
    path = tmp_path / "state.npz"
    np.savez(path, spec=np.array([print], dtype=object))
    with pytest.raises(InputError, match="is not a saved proof state"):
        load(Prover(spec), path, "this")


NOTHING = np.zeros(0, np.int64)


@pytest.mark.parametrize(
    "change",
    [
        {"parts_rows": np.zeros((2, 0)), "parts_counts": np.array([0, 0])},  # parts twice
        {"parts_rows": np.zeros((0, 0)), "parts_counts": NOTHING},  # not at all
        {"parts_boxes": np.zeros((3, 2, 2)), "parts_counts": np.array([3])},  # of two cubes
        {"waiting_boxes": np.zeros((0, 1, 2))},
        {"waiting_boxes": np.array([[["a", "b"]]])},
        {"waiting_rows": np.zeros((1, 0), np.int64)},
        {"waiting_rows": np.zeros((1, 8), np.int64)},
        {"ended_rows": np.zeros((1, 1), np.int64), "ended_counts": np.array([1])},
        {"ways_rows": np.array([[99, 0, 0]]), "ways_counts": np.array([0])},
        {"part_boxes": np.zeros((0, 1, 2)), "part_counts": np.array([0])},  # yet something waits
        {"waiting_rows": np.zeros((0, 7), np.int64), "waiting_counts": NOTHING},
        {"done_rows": np.zeros((1, 2), np.int64), "done_counts": np.array([0])},
        {"undecided_rows": np.zeros((0, 0)), "undecided_counts": NOTHING},
        {"steps_rows": np.zeros((1, 4), np.int64)},  # and no volume
        {"steps_rows": np.full((1, 4), 99), "steps_volumes": np.array([1.0])},
        {"steps_rows": np.array([[1, 1, 0, 9]]), "steps_volumes": np.array([np.nan])},
        {"counts": np.full(6, np.nan)},
        {"counts": np.full(6, np.inf)},
        {"counts": np.zeros(5)},
    ],
)
def test_a_state_that_makes_no_sense_is_refused_and_nothing_taken_over(spec, tmp_path, change):
    path, fresh = tmp_path / "state.npz", Prover(spec)
    begun = Prover(spec)
    begun.advance()
    save(begun, path, "this")
    with np.load(path) as arrays:
        state = {**arrays, "ended_boxes": np.zeros((1, 1, 2)), "ways_boxes": np.zeros((0, 1, 2))}
    np.savez(path, **(state | change))
    with pytest.raises(InputError, match="is not a saved proof state"):
        load(fresh, path, "this")
    assert not fresh.waiting and not fresh.ended and not fresh.fork_ends and not fresh.forked
    assert not len(fresh.part) and not fresh.done.endings and not fresh.done.steps
    assert fresh.num_states == 0 and fresh.parts.tolist() == [[[-6.0, 6.0]]]


def test_a_number_as_subject_is_of_another_proof(spec, tmp_path):
    path = tmp_path / "state.npz"
    save(Prover(spec), path, "this")
    with np.load(path) as arrays:
        state = {**arrays, "subject": np.array(2**62)}
    np.savez(path, **state)
    with pytest.raises(InputError, match="belongs to another proof"):
        load(Prover(spec), path, "this")
