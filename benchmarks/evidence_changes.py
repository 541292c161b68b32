"""Changes of evidence that make one sentence false.

Each row contains the name of the sentence, the change, and optionally changes that are made before
so that the sentence appears.
"""

from benchmarks.evidence import EXPLANATION, HIGHER, PROOF, SHIFTS, SWEEP, VERDICT

FRESH_SEED = {"seed_is_fixed": False}
OTHER_SEED = {"seed": 193287468211}
_TRIVIAL = {"baselines.forward.success.share": 0.95}
_NO_FAILURES = {"failures.largest": None, "failures.bound.successes": 0}
_IN_WIND = {"unlike": {"wind": {"own": [0.0, 0.0, 0.0], "flown": [5.0, 0.0, 0.0]}}}
_UNDECIDED = {"certain": False, "enough": 1600}
_PROVED = {"proof": PROOF}
_PARTLY_PROVED = {"proof": {**PROOF, "every": False, "share": 0.6, "lost": 0.3, "undecided": 0.1}}
_REFUSED = {"proof": {"refused": "it is of another network"}}
_ROUNDED = {"certain": False, "rounding.decides": True}
OF_VERDICTS = (
    ("kind", {"certain": False}),
    ("kind", {"kind": "good"}),
    ("kind", {"kind": "one-sided (right)"}),
    ("kind", {"greedy.shares.all.mean": 0.3}, {"kind": "poor", "greedy.shares.all.mean": 0.35}),
    ("open", {"certain": True}, _UNDECIDED),
    ("open", {"enough": None}, _UNDECIDED),
    ("open", {"rounding.decides": True}, _UNDECIDED),
    ("rounding", {"rounding.decides": False}, _ROUNDED),
    ("rounding", {"rounding.unexplained": 3}, _ROUNDED),
    ("arithmetic", {"rounding": None}),
    ("arithmetic", {"rounding.bound": False}),
    ("arithmetic", {"rounding.arithmetic": "float32 on cuda, PyTorch"}),
    ("proof.every", {"proof": None}, _PROVED),
    ("proof.every", {"proof.every": False}, _PROVED),
    ("proof.every", _REFUSED, _PROVED),
    ("proof.every", {"num_cubes": 2}, _PROVED),
    ("proof.share", _PROVED, _PARTLY_PROVED),
    ("proof.share", _REFUSED, _PARTLY_PROVED),
    ("proof.share", {"proof.share": 0.5}, _PARTLY_PROVED),
    ("proof.share", {"proof.lost": 0.4, "proof.undecided": 0.0}, _PARTLY_PROVED),
    ("proof.share", {"proof.finished": False}, _PARTLY_PROVED),
    ("proof.basis", {"proof": None}, _PROVED),
    ("proof.basis", {"proof.checked": 2000}, _PROVED),
    ("proof.basis", {"proof.wrong_at_most": None}, _PROVED),
    ("proof.basis", {"proof.wrong_at_most": 0.02}, _PROVED),
    ("proof.basis", {"proof.seed_is_fixed": True}, _PROVED),
    ("proof.basis", {"proof.agreeing": 0}, _PROVED),
    ("proof.refused", _PROVED, _REFUSED),
    ("proof.refused", {"proof.refused": "it contradicts itself"}, _REFUSED),
    ("shares", {f"greedy.shares.{side}.mean": 1.0 for side in ("left", "ahead", "right")}),
    ("shares", {"greedy.shares.left": {"mean": None, "count": 0}}),
    ("baselines", _TRIVIAL),
    ("baselines", {"baselines.oracle.shares.all.mean": 0.7}),
    ("pointless", {"baselines.forward.success.share": 0.3}, _TRIVIAL),
    ("pointless", {"kind": "good, but trivial"}, _TRIVIAL),
    ("kind", {"baselines.forward.success.share": 0.92}, {**_TRIVIAL, "kind": "good, but trivial"}),
    ("hopeless", {"baselines.oracle.success.upper95": 0.6},
     {"baselines.oracle.success.upper95": 0.4}),
    ("failures.largest", {"failures.largest": None}),
    ("failures.largest", {"failures.largest.value": "right"}),
    ("failures.largest", {"failures.rows.1.lower95": 0.0}),
    ("failures.never", {"failures.largest": VERDICT["failures"]["largest"]}, _NO_FAILURES),
    ("failures.never", {"failures.bound.upper95": 0.2}, _NO_FAILURES),
    ("unlike", {"unlike": {}}, _IN_WIND),
    ("unlike", {"unlike": {"wind": {"own": [0.0, 0.0, 0.0], "flown": [8.0, 0.0, 0.0]}}}, _IN_WIND),
    ("drawing", {"drawing.upper95": 0.05}),
    ("drawing", {"drawing": None}),
    ("fixed_seed", FRESH_SEED),
    ("fixed_seed", OTHER_SEED),
    ("fixed_seed", {"seed": None}),
)  # fmt: skip
_OTHER_ACTIONS = {"rounding.differing": 5}
_EXCESSIVE = {"rounding.excessive": True, "rounding.fragile": 400, "rounding.fragile_rate": 0.2}
OF_EVALUATIONS = (
    ("computed", {"rounding": None}),
    ("computed", {"rounding.arithmetic": "float32 on cuda, PyTorch"}),
    ("computed.same", _OTHER_ACTIONS),
    ("computed.same", {"rounding": None}),
    ("computed.other", {"rounding.differing": 0}, _OTHER_ACTIONS),
    ("computed.other", {"rounding.differing": 6}, _OTHER_ACTIONS),
    ("computed.fragile", {"rounding.excessive": False}, _EXCESSIVE),
    ("computed.fragile", {"rounding.fragile": 300, "rounding.fragile_rate": 0.15}, _EXCESSIVE),
)
_CERTAIN_GOOD = {"verdict.kind": "good", "verdict.certain": True, "verdict.exit_code": 0}
_NOT_CERTAIN = {"verdict.certain": False, "verdict.enough": 1600}
_NO_PAIR = {"contradictions.pairs": 0}
_NO_LOOP = {"loops.loops": 0, "loops.episodes.successes": 0}
_ONE_ACTION = {"dataset.action_shares": [0.0, 1.0, 0.0]}
_NO_LAYER = {"attribution.layer": None}
_NO_SIDE = {"asymmetry.dataset.signed.upper95": 0.1}
_NO_MAP = {"places": {"refused": "it has a memory"}}
_ALL_HEIGHTS = {"response.rows": [*EXPLANATION["response"]["rows"], *HIGHER]}
_LEFT_BLIND = "response.rows.0.blind"
_MEASURED = {"shifts": SHIFTS, "verdict.kind": "good", "verdict.certain": True}
_REFUSED_SHIFTS = {"shifts": {"refused": "it is of another task"}}
_OTHER_KIND = {"verdict.kind": "poor", "verdict.certain": True}
OF_REPORTS = (
    ("source.file", {"source": "b/explanation.json"}),
    ("source.file", {"date": None}),
    ("source.file", {"provenance.git_revision": None}),
    ("explanation.fixed_seed", FRESH_SEED),
    ("explanation.fixed_seed", OTHER_SEED),
    ("domain.quoted", {"shifts.seed_is_fixed": False}, _MEASURED),
    ("advice.more", {"verdict.certain": True}, _NOT_CERTAIN),
    ("advice.more", {"verdict.enough": None}, _NOT_CERTAIN),
    ("advice.more", {"verdict.rounding.decides": True}, _NOT_CERTAIN),
    ("advice.use", {"verdict.certain": False}, _CERTAIN_GOOD),
    ("advice.use", {"verdict.kind": "poor"}, _CERTAIN_GOOD),
    ("advice.refuse", _CERTAIN_GOOD),
    ("advice.refuse", {"verdict.exit_code": 10}),
    ("scope.one_look", _MEASURED),
    ("scope.one_look", {"shifts.axes.blur.group": "color"}, _MEASURED),
    ("domain.quoted", _REFUSED_SHIFTS, _MEASURED),
    ("domain.quoted", {"shifts.domain.ranges.blur.high": 1.0}, _MEASURED),
    ("domain.quoted", _OTHER_KIND, _MEASURED),
    ("domain.quoted", {"verdict.good_share": 0.99}, _MEASURED),
    ("domain.refused", _MEASURED, _REFUSED_SHIFTS),
    ("domain.refused", {"shifts.refused": "it is of another network"}, _REFUSED_SHIFTS),
    ("dataset.size", {"dataset.episodes": 31}),
    ("dataset.actions", _ONE_ACTION),
    ("dataset.one_action", {"dataset.action_shares": [0.001, 0.999, 0.0]}, _ONE_ACTION),
    ("dataset.entropy", {"dataset.entropy.mean": None}),
    ("dataset.entropy", {"dataset.entropy.upper95": 0.5}),
    ("dataset.none_reached", {"dataset.goals_reached": 1}, {"dataset.goals_reached": 0}),
    ("tsne.faithful", {"tsne.pixels.neighbours_kept": 0.3}),
    ("tsne.unfaithful", {"tsne.pixels.neighbours_kept": 0.6}, {"tsne.pixels.neighbours_kept": 0.4}),
    ("contradictions.none", {"contradictions.pairs": 1}, _NO_PAIR),
    ("contradictions.pairs", _NO_PAIR),
    ("contradictions.pairs", {"contradictions.unknown": 0, "contradictions.justified": 3}),
    ("contradictions.worst", {"contradictions.contradictions": 0}),
    ("loops.none", {"loops.loops": 1}, _NO_LOOP),
    ("loops.none", {"loops.episodes.upper95": 0.3}, _NO_LOOP),
    ("loops.some", _NO_LOOP),
    ("loops.some", {"loops.episodes.successes": 4}),
    ("class_model.reached", {"class_model.logit.probabilities": [0.99, 0.9, 0.98]}),
    ("class_model.not_reached", {"class_model.probability.highest": [0.9, 0.8, 0.9]}),
    ("class_model.not_reached", {"class_model.logit.highest": [0.99, 0.4, 0.2],
                                 "class_model.probability.highest": [0.9, 0.3, 0.2]}),
    ("attribution.layer", _NO_LAYER),
    ("attribution.no_convolution", {"attribution.layer": "relu1"}, _NO_LAYER),
    ("attribution.no_convolution", {"attribution.shown": "occlusion"},
     {**_NO_LAYER, "attribution.shown": "saliency"}),
    ("attribution.stand_in", {"attribution.film.heat_by": ["grad_cam", None]}),
    ("left_out.why", {"left_out": {}}),
    ("left_out.why", {"left_out.embedding": "It has no eyes."}),
    ("attribution.no_heat", {"attribution.film.heat_by": ["grad_cam", "grad_cam_logit"]}),
    ("response.collected", {"response.rows.0.collected": 3}),
    ("response.collected", {f"response.rows.{i}.places": 0 for i in range(3)}),
    ("response.heights", {"response.rows": EXPLANATION["response"]["rows"]}, _ALL_HEIGHTS),
    ("response.blind", {_LEFT_BLIND: 0.0}),
    ("response.blind", {_LEFT_BLIND: None}),
    ("places.does", _NO_MAP),
    ("places.does", {"places.sides.left.actions": [0.5, 0.5, 0.0]}),
    ("places.unseen", {"places.unseen": 0.0}),
    ("places.blind", {"places.blind": 0.0}),
    ("places.blind", {"places.alone": 1}),
    ("places.sees", {"places.blind": 0.1}, {"places.blind": 0.0}),
    ("places.gap", {"places.least_gap": 0.5}),
    ("places.gap", {"places.least_gap_left": 1.5}),
    ("places.close", {"places.close": 0.0}),
    ("places.doubt", {"places.in_doubt": 0.0}),
    ("places.refused", {"places": EXPLANATION["places"]}, _NO_MAP),
    ("asymmetry.differs", {"asymmetry.dataset.absolute.mean": 0.01}),
    ("asymmetry.prefers", _NO_SIDE),
    ("asymmetry.prefers", {"asymmetry.dataset.signed": {"mean": 0.2, "lower95": 0.1,
                                                        "upper95": 0.3}}),
    ("asymmetry.undecided", {"asymmetry.dataset.signed.upper95": -0.01}, _NO_SIDE),
)  # fmt: skip
_NONE_TRUSTED = {
    "truth.trusted": None,
    "truth.methods.saliency.trusted": False,
    "truth.methods.saliency.failed": ["likeness"],
}
_UNMOVED = {**_NONE_TRUSTED, "truth.frames": 0}
_NOT_FOLLOWING = {"truth.outcomes.follows.lower95": -0.1}
OF_MAPS = (
    ("truth.trusted", _NONE_TRUSTED),
    ("truth.trusted", {"truth.placebos.ones.mean": 0.9}),
    ("truth.hits", _NONE_TRUSTED),
    ("truth.hits", {"truth.methods.saliency.pointing.hit": 0.2}),
    ("truth.none", {"truth.trusted": "saliency"}, _NONE_TRUSTED),
    ("truth.none", {"truth.frames": 0}, _NONE_TRUSTED),
    ("truth.refused", {"truth.methods.occlusion.trusted": True}),
    ("truth.refused", {"truth.methods.occlusion.failed": ["random weights"]}),
    ("truth.refused", {"truth.methods.occlusion.placebos.horizon.lower": 0.1}),
    (
        "truth.untested",
        {"truth.methods": EXPLANATION["truth"]["methods"]},
        {"truth.methods": {}, "truth.trusted": None},
    ),
    ("truth.untested", {"truth.frames": 0}, {"truth.methods": {}, "truth.trusted": None}),
    ("truth.unmoved", {"truth.frames": 5}, _UNMOVED),
    ("truth.left_out", {"truth.frames_unmoved": 0}),
    ("truth.follows", _NOT_FOLLOWING),
    ("truth.follows", {"truth.outcomes.follows.mean": 0.7}),
    ("truth.follows_not", {"truth.outcomes.follows.lower95": 0.1}, _NOT_FOLLOWING),
    ("truth.ground", {"truth.outcomes.ground_changed.upper95": 0.4}),
    ("truth.patch", {"truth.interventions.ground patch changed.upper95": 0.5}),
    ("truth.target", {"truth.interventions.ground patch changed.upper95": 0.31}),
    ("truth.target", {"truth.interventions.target taken away.lower95": 0.19}),
    ("truth.integral", {"truth.integration_error": None}),
)
_UNCERTAIN = {"verdict.certain": False}
_DYNAMICS = {
    "mode": "simple_flight",
    "wind": [0.0, 3.0, 4.0],
    "gusts": 1.5,
    "mass": 1.0,
    "control_ticks": 66,
    "tick": 0.003,
}
OF_CARDS = (
    ("card.verdict", _UNCERTAIN),
    ("card.verdict", {"verdict.kind": "good"}),
    ("card.reported", {"worlds": "choice"}),
    ("card.reported", {"verdict.proof": PROOF}),
    ("card.chosen", {"chosen": None}),
    ("card.chosen", {"chosen.episodes": None}),
    ("card.not_chosen", {"chosen": {"runs": 3, "episodes": 200}}, {"chosen": None}),
    ("card.tested", {"task.vertical_bound": 1.2}),
    ("card.tested", _MEASURED),
    ("card.body", {"dynamics": None}, {"dynamics": _DYNAMICS}),
    ("card.body", {"dynamics.wind": [0.0, 0.0, 0.0]}, {"dynamics": _DYNAMICS}),
    ("card.domain", {"shifts": None}, _MEASURED),
    ("card.domain", {"shifts.domain.ranges.sun.low": 40.0}, _MEASURED),
    ("card.domain", _OTHER_KIND, _MEASURED),
    ("card.greedy_only", {"verdict.sampled": VERDICT["sampled"]}, {"verdict.sampled": None}),
)
_ALL_CERTAIN = {"certain": 5}
_NOT_SOLVED = {"groups.0.solved.successes": 0}
_NO_BEST = {"best": None}
_NOT_JUDGED = {"judged": 0, "certain": 0}
_NOTHING_ENDED = {"unfinished": 9, "finished": 0, "failed": 0, "damaged": 0}
OF_SWEEPS = (
    ("runs.counts", {"failed": 2}),
    ("runs.read", _NOTHING_ENDED),
    ("runs.failed", {"failed": 0}),
    ("runs.damaged", {"damaged": 0}),
    ("runs.copies", {"copies": 0}),
    ("runs.unfinished", {"unfinished": 0}),
    ("runs.solved_none", {"groups.0.solved.successes": 1}, _NOT_SOLVED),
    ("runs.few", {"groups.1.ended": 6}),
    ("runs.censored", {"groups.1.frames_to_solve.more_than": None}),
    ("verdicts.basis", _NOT_JUDGED),
    ("verdicts.basis", {"episodes": [100, 200]}),
    ("verdicts.certain", {"certain": 4}, _ALL_CERTAIN),
    ("verdicts.certain", {"error_rates": [0.05, 0.2]}, _ALL_CERTAIN),
    ("verdicts.not_certain", _ALL_CERTAIN),
    ("verdicts.older_rule", {"judged_by_older_rule": 0}),
    ("verdicts.missing", {"never_judged": 0}),
    ("best.none", {"best": SWEEP["best"]}, _NO_BEST),
    ("best.chosen", {"best.certain": False}),
    ("best.chosen", _NO_BEST),
    ("best.equals", {"best.equals": 0}),
    ("best.flattered", {"judged": 1}),
    ("best.report", _NO_BEST),
    ("curves.band", {"groups.0.ended": 5}),
    ("curves.runs", {"groups.1.ended": 6}),
    ("curves.ends", {"finished": 0}),
    ("curves.failed", {"failed": 0}),
    ("shares.bars", _NOT_JUDGED),
    ("sides.dots", {"sides_not_offered": 5}),
    ("sides.lost_left", {"runs.1.verdict": "good"}),
    ("sides.lost_right", {"runs.0.verdict": "good"}),
    ("sides.not_offered", {"sides_not_offered": 0}),
    ("entropies.dots", {"runs": [{**run, "entropy": None} for run in SWEEP["runs"]]}),
    ("entropies.still", {"runs.2.entropy": 0.5}),
    ("costs.dots", _NOT_SOLVED),
    ("costs.open", {"groups.1.solved.successes": 2}),
    ("settings.intervals", _NOTHING_ENDED),
)
OF_SETTINGS = (
    ("group.none", {"ended": 1}, {"ended": 0}),
    ("group.solved", {"solved.successes": 6}),
    ("group.verdicts", {"judged": 0}),
    ("group.verdicts", {"verdicts.good.certain": 5}),
    ("group.unknown", {"judged": 6}),
    ("group.unfinished", {"unfinished": 0}),
)
_NOT_GOOD = {
    "domain.plain.good": False,
    "domain.ranges.sun.positions": None,
    "domain.ranges.blur.positions": None,
    "domain.ranges.brightness.positions": None,
}
_UNCHANGED_BLUR = "axes.blur.levels.1.modes.constant.unchanged"
_TOO_FEW = {"domain.ranges.brightness.failed.0.bad": False}
OF_SHIFTS = (
    ("shifts.good", _NOT_GOOD),
    ("shifts.good", {"domain.ranges.sun.low": 40.0}),
    ("shifts.good", {"domain.ranges.sun.high_open": False}),
    ("shifts.good", {_UNCHANGED_BLUR: True}),
    ("shifts.good", {"domain": None}),
    ("shifts.not", _NOT_GOOD),
    ("shifts.not", _TOO_FEW),
    ("shifts.not", {"domain.ranges.brightness.failed.0.worst": {"side": "left", "share": 0.2}}),
    ("shifts.not", {"domain.ranges.brightness.positions": [-0.1, 0.0]}),
    ("shifts.not", {"domain.ranges.brightness.failed.0.impossible": True}),
    ("shifts.too_few", {"domain.ranges.brightness.failed.0.bad": True}, _TOO_FEW),
    ("shifts.none", {"domain.plain.good": True}, _NOT_GOOD),
    ("shifts.none", {"domain": None}, _NOT_GOOD),
    ("shifts.untested", {_UNCHANGED_BLUR: False}, {_UNCHANGED_BLUR: True}),
    ("shifts.impossible", {"axes.sun.levels.1.impossible": False}),
    ("shifts.impossible", {"axes.sun.levels.1.oracle.share": 0.3}),
    ("shifts.impossible", {"domain.ranges.brightness.failed.0.impossible": False},
     {"domain.ranges.brightness.failed.0.impossible": True}),
    ("shifts.together", {"together.refused": "task.cube_size=99"}),
    ("shifts.together", {"together.modes.constant.success.share": 0.5}),
    ("shifts.scope", _NOT_GOOD),
    ("shifts.fixed_seed", FRESH_SEED),
    ("shifts.fixed_seed", OTHER_SEED),
)  # fmt: skip
