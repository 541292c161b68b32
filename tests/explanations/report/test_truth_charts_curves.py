from drone_rl.explanations.report.explanation import METHOD_NAMES as NAMES
from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.truth import curves_charts
from drone_rl.utils.palette import MUTED, css


def test_methods_have_their_dashes_and_placebos_are_gray(explanations):
    loaded = Explanation.load(explanations[0])
    curves = loaded.numbers["truth"]["curves"]
    charts = curves_charts(loaded)
    methods = [n for n in curves if n in NAMES]
    assert len(methods) == 5 and len(curves) == 5 + 7 + 1
    for action in ("left", "forward", "right"):
        lines = charts[f"{action}, deletion (lower is better)"].axes[0].lines
        gray = [line for line in lines if line.get_color() == css(MUTED)]
        assert (len(gray), len(lines)) == (7, 12)
        wanted = curves[methods[0]][action]["deletion"]["curve"]
        if wanted is not None:
            drawn = next(line for line in lines if line.get_label() == NAMES[methods[0]])
            assert drawn.get_ydata().tolist() == wanted
