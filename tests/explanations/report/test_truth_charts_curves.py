from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.truth import curves_chart
from drone_rl.explanations.report.validation import METHOD_NAMES as NAMES


def test_methods_have_their_colour_and_placebos_are_dashed(explanations):
    loaded = Explanation.load(explanations[0])
    curves = loaded.numbers["truth"]["curves"]
    figure = curves_chart(loaded)
    axes = {axis.get_title(): axis for axis in figure.axes}
    methods = [n for n in curves if n in NAMES]
    assert len(methods) == 5 and len(curves) == 5 + 7 + 1
    for action in ("left", "forward", "right"):
        lines = axes[f"{action}, deletion\n(lower is better)"].lines
        dashed = [line for line in lines if line.get_linestyle() == "--"]
        assert (len(dashed), len(lines)) == (7, 12)
        wanted = curves[methods[0]][action]["deletion"]["curve"]
        if wanted is not None:
            drawn = next(line for line in lines if line.get_label() == NAMES[methods[0]])
            assert drawn.get_ydata().tolist() == wanted
