import numpy as np

from drone_rl.explanations.attribution import FILMED, section


def test_maps_of_all_frames_and_a_film_of_the_first_flight(context):
    numbers, arrays = section(context)
    found = numbers["attribution"]
    steps = int((context.flights.episode == FILMED).sum())
    assert {n for n in arrays if n.startswith("map_")} == {f"map_{m}" for m in found["methods"]}
    for method in found["methods"]:
        maps = arrays[f"map_{method}"].reshape(40, -1)
        assert set(np.unique(maps.max(1))) <= {0.0, 1.0}  # nothing, or a peak of one
    assert len(arrays["film_frames"]) == len(found["film"]["heat_by"]) == steps
    assert arrays["film_actions"].tolist() == context.flights.actions[:steps].tolist()
    assert np.allclose(arrays["film_probabilities"].sum(-1), 1, atol=1e-3)


def test_each_step_of_the_film_says_whose_heat_it_shows(context):
    numbers, arrays = section(context)
    film = numbers["attribution"]["film"]
    for by, heat in zip(film["heat_by"], arrays["film_heat"], strict=True):
        assert (by is None) == (heat.max() == 0)
    assert {by for by in film["heat_by"] if by} <= {"grad_cam", "grad_cam_logit"}
    assert all(0 <= entry["step"] < len(film["heat_by"]) for entry in film["key_steps"])
