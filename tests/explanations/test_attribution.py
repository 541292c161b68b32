import numpy as np
import torch

from drone_rl.explanations.attribution import FILMED, first_heat, section, shown_methods


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


def test_the_report_shows_grad_cam_and_without_it_the_first_other_method():
    every = ["occlusion", "saliency", "grad_cam_logit", "grad_cam"]
    assert shown_methods(every) == ["grad_cam", "grad_cam_logit"]
    assert shown_methods(["occlusion", "saliency"]) == ["saliency"]
    assert shown_methods(["occlusion"]) == ["occlusion"] and shown_methods([]) == []


def test_a_step_without_heat_shows_the_next_method():
    one, two = torch.zeros(3, 1, 2), torch.zeros(3, 1, 2)
    one[0, 0, 1], two[0], two[1, 0, 0] = 0.5, 7.0, 0.25
    heat, by = first_heat({"one": one, "two": two})
    assert heat.tolist() == [[[0.0, 0.5]], [[0.25, 0.0]], [[0.0, 0.0]]]
    assert by == ["one", "two", None]
