from drone_rl.flight.commands.state import Trajectory


def test_it_grows(hovering):
    way = Trajectory()
    assert (len(way), way.positions.shape) == (0, (0, 3))
    body = hovering((1, 2, 3))
    way.append(0.5, body)
    body.position[0, 0] = 9.0  # what is noted stays
    body.velocity[0, 1] = 4.0
    way.append(0.75, body)
    assert way.times.tolist() == [0.5, 0.75]
    assert way.positions.tolist() == [[1, 2, 3], [9, 2, 3]]
    assert way.velocities.tolist() == [[0, 0, 0], [0, 4, 0]]
    assert way.attitudes.tolist() == [[1, 0, 0, 0]] * 2
    assert way.rotors.shape == (2, 4)
