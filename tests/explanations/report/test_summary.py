from drone_rl.explanations.report.summary import LINES, say_summary
from tests.evidence import EXPLANATION, PROOF, SHIFTS, changed


def speak(**changes):
    evidence = changed(EXPLANATION, {k.replace("__", "."): v for k, v in changes.items()})
    return say_summary(evidence)


def test_each_question_has_one_line_in_order():
    for evidence in (EXPLANATION, {"left_out": {}}):
        names = [name.split(".")[1].split("_")[0] for name in say_summary(evidence)]
        expected = [n for n in LINES if n != "success" or "verdict" in evidence]
        assert names == expected


def test_rates_have_one_decimal_and_an_interval():
    assert speak()["summary.success"] == (
        "The most probable actions have every cube collected in 60.0% (95% CI 58.0 to 62.0) of 400 "
        "episodes."
    )


def test_robustness_names_the_axes_with_a_range():
    found = speak(shifts=SHIFTS, verdict__kind="good")
    assert found["summary.robustness"] == (
        "Good with 95% confidence in a range of 2 of 3 perturbations tested: elevation of the sun "
        "and blur."
    )
    found = speak(shifts={"refused": "it is of another task"})
    assert found["summary.robustness_refused"].endswith("not shown here: it is of another task.")


def test_only_a_certificate_that_was_checked_is_called_one_of_success():
    assert "1,000 rollouts" in speak(verdict__proof=PROOF)["summary.certificate"]
    unchecked = {**PROOF, "wrong_at_most": None}
    assert "not a proof" in speak(verdict__proof=unchecked)["summary.certificate_partly"]
    assert "drone-rl prove" in speak()["summary.certificate_none"]


def test_what_was_not_run_is_said_with_the_command_that_adds_it():
    found = say_summary({})
    assert found["summary.verdict_missing"] == "Not run; drone-rl explain adds it."
    assert "t-SNE" in found["summary.limits"] and "drone-rl explain" in found["summary.limits"]
    assert "shifts" in found["summary.robustness_unknown"]
    assert speak()["summary.limits"] == (
        "Real cameras and drones, other colors, light or sizes and what was left out (embedding)."
    )


def test_sections_that_were_not_run_are_named_also_if_others_were_left_out():
    assert speak(tsne=None, response=None)["summary.limits"] == (
        "Real cameras and drones, other colors, light or sizes, what was left out (embedding) and "
        "what was not run (response map; drone-rl explain adds it)."
    )


def test_an_axis_without_effect_is_not_counted_as_tested():
    same = changed(SHIFTS, {"axes.blur.levels.1.modes.constant.unchanged": True})
    found = speak(shifts=same, verdict__kind="good")["summary.robustness"]
    assert "a range of 1 of 2 perturbations tested: elevation of the sun." in found
