"""A small explanation with every section, made by hand; nothing was measured."""

import numpy as np

from drone_rl.explanations.results import Explanation
from drone_rl.sim.vocabulary import SHOWN_MOVES, shipped_vocabulary
from drone_rl.trust.shifts_results import packed
from tests.evidence import SAVED_SHIFTS, SHIFTS, VERDICT, changed

CUBES = shipped_vocabulary("collect_cubes")

FRAMES, STEPS, ACTIONS = 12, 5, 3  # of the data set, in two episodes; of the film


def mean(value, lower, upper):
    return {"mean": value, "lower95": lower, "upper95": upper, "count": 30}


def median(lower, value, upper):
    return {"median": value, "lower": lower, "upper": upper}


def method(trusted, failed, score):
    return {
        "trusted": trusted,
        "failed": failed,
        "score": mean(score, score - 0.1, score + 0.1),
        "placebos": {
            "ones": median(score - 0.1, score, score + 0.1),
            "horizon": median(score - 0.3, score - 0.2, score),
        },
        "pointing": {**median(0.1, 0.3, 0.5), "hit": 0.6, "chance": 0.1},
        "likeness": {**median(0.1, 0.2, 0.3), "seeds": [0.2]},
    }


def input_effect(matters, *excess):
    effects = {"effect": median(*excess), "placebo": median(0.0, 0.0, 0.0)}
    return {**effects, "excess": median(*excess), "matters": matters}


def optimized(probabilities, highest):
    images = np.zeros((ACTIONS, 1, 4, 30))
    images[1] = 1.0  # that for left is white
    return {
        "probabilities": probabilities,
        "highest": highest,
        "attempts": 48,
        "images": images,
    }


def row(side, height, blind, collected):
    return {"side": side, "height": height, "blind": blind, "collected": collected, "places": 72}


def target_grid(forward, lateral):
    return {
        "height": np.array([0.0, 1.5]),
        "forward": np.array(forward),
        "lateral": np.array(lateral),
        "oracle": np.zeros(len(lateral)),
        "stratum": np.zeros(len(lateral)),
    }


def response():
    probabilities = np.zeros((2, 3, 4, ACTIONS))
    probabilities[..., 0] = 1.0
    probabilities[1, 2, 3] = [0.25, 0.5, 0.25]
    blind, collected = np.zeros((2, 3, 4), bool), np.zeros((2, 2, 2), bool)
    blind[0, 0, 0] = collected[1, 0, 1] = True
    return {
        "rows": [
            *(row("left", 0.0, 0.6, 64), row("ahead", 0.0, 0.0, 72), row("right", 0.0, 0.5, 60)),
            row("left", 1.2, 0.6, 50),
        ],
        "blind_below": 0.1,
        "asymmetry": 0.25,
        "map": {
            **target_grid([2.0, 4.0, 6.0], [-3.0, -1.0, 1.0, 3.0]),
            "probabilities": probabilities,
            "without_target": np.array([1.0, 0.0, 0.0]),
            "blind": blind,
        },
        "outcome": {**target_grid([2.0, 6.0], [-3.0, 3.0]), "collected": collected},
    }


def side(share, actions, unseen, blind):
    return {"share": share, "actions": actions, "unseen": unseen, "blind": blind}


def embedding(layer):
    return {
        "layer": layer,
        "perplexity": 30,
        "neighbours": 10,
        "neighbours_kept": 0.8,
        "neighbours_chance": 0.02,
        "trustworthiness": 0.99,
        "points": np.random.default_rng(1).normal(size=(FRAMES, 2)),
    }


def data():
    rng, episode = np.random.default_rng(0), np.repeat([0, 1], FRAMES // 2)
    return {
        "frames": rng.integers(0, 255, (FRAMES, 4, 60, 3), dtype=np.uint8),
        "actions": np.arange(FRAMES) % ACTIONS,
        "probabilities": rng.dirichlet(np.ones(ACTIONS), FRAMES),
        "episode": episode,
        "step": np.tile(np.arange(FRAMES // 2), 2),
        "event": (np.arange(FRAMES) == 2).astype(np.int8),
        "flights/episode": episode,
    }


CONTENT = {
    "name": "a policy",
    "source": "a/explanation.json",
    "date": "2026-01-31T12:00:00+00:00",
    "settings": {},
    "seed": 0,
    "seed_is_fixed": True,
    "seconds": {},
    "actions": SHOWN_MOVES,
    "terms": CUBES,
    "provenance": {"git_revision": "0123abc"},
    "verdict": VERDICT,
    "dataset": {
        "frames": 600,
        "episodes": 30,
        "steps": 1300,
        "action_shares": [0.8, 0.1, 0.1],
        "entropy": mean(0.1, 0.06, 0.2),
        "goals_reached": 60,
    },
    "tsne": {"features": embedding("fc1"), "pixels": embedding(None)},
    "flaws": {
        "pairs": [
            {"left": 1, "right": 2, "distance": 0.1, "opposition": 0.7, "kind": "contradiction"},
            {"left": 3, "right": 4, "distance": 0.1, "opposition": 0.6, "kind": "unknown"},
        ],
        "alike_metres": 1.0,
        "loops": [{"first": 4, "length": 9, "reversals": 3}],
        "looping_steps": 0.02,
        "looping_episodes": {
            **{"share": 0.1, "lower95": 0.02, "upper95": 0.27},
            **{"successes": 3, "trials": 30},
        },
    },
    "class_model": {
        "statistics": {"mean": 0.5, "std": 0.1, "low": 0.0, "high": 1.0, "roughness": 1.0},
        "channels": "gray",
        "probability": optimized([0.9, 0.3, 0.9], [0.9, 0.3, 0.9]),
        "logit": optimized([0.99, 0.4, 0.98], [0.99, 0.4, 0.98]),
    },
    "attribution": {
        "layer": "relu2",
        "shown": "grad_cam",
        "heat_by": ["grad_cam", "grad_cam_logit", None, "grad_cam", "grad_cam"],
        "key_steps": [{"step": t, "why": "first"} for t in (0, 2, 4, 1)],
        "frames": np.zeros((STEPS, 4, 20, 3), np.uint8),
        "heat": {
            "grad_cam": np.ones((STEPS, 4, 20), np.float16),
            "grad_cam_logit": np.ones((STEPS, 4, 20), np.float16),
            "saliency": np.tri(4, 20, dtype=np.float16)[None].repeat(STEPS, 0),
        },
        "probabilities": np.full((STEPS, ACTIONS), 1 / ACTIONS),
        "actions": np.array([0, 1, 2, 0, 1]),
    },
    "truth": {
        "trusted": "saliency",
        "methods": {
            "saliency": method(True, [], 0.5),
            "grad_cam": method(False, ["placebos", "pointing"], 0.1),
        },
        "placebos": {"ones": mean(0.0, 0.0, 0.0), "horizon": mean(0.3, 0.2, 0.4)},
        "frames": 280,
        "frames_unmoved": 20,
        "episodes": 30,
        "level": 0.01,
        "confidence": 0.98,
        "outcomes": {
            "flights": 60,
            "collected": {},
            "follows": mean(0.8, 0.6, 0.95),
            "ground_changed": mean(0.02, 0.0, 0.1),
        },
        "interventions": {
            "target taken away": mean(0.4, 0.3, 0.5),
            "ground patch changed": mean(None, 0.0, 1.0),
        },
        "shown_frame": 3,
        "changed": np.zeros((2, 4, 60, 3), np.uint8),
        "patch_effects": np.ones((2, 3)),
    },
    "response": response(),
    "places": {
        "window": {"nearest": 2.0, "farthest": 4.0, "sideways": 3.0},
        "area": 12.0,
        "cells": 7,
        "touch_distance": 1.5,
        "least_gap": 0.1,
        "least_gap_ahead": 3.0,
        "least_gap_left": 2.0,
        "sides": {
            "left": side(0.4, [0.75, 0.25, 0.0], 0.2, 0.75),
            "ahead": side(0.2, [1.0, 0.0, 0.0], 0.0, 0.0),
            "right": side(0.4, [0.5, 0.0, 0.5], 0.0, 0.5),
        },
        "actions": [0.7, 0.1, 0.2],
        "alone": 0,
        "unseen": 0.08,
        "blind": 0.5,
        "logit_gap": 0.0001,
        "close": 0.0003,
        "in_doubt": 0.0002,
        "outlines": {
            "points": np.array(
                [
                    *((2, -3), (4, -3), (4, 1), (2, 1)),  # forward, mostly to the right
                    *((2, 1), (4, 1), (4, 3), (2, 3)),  # left
                    *((2, 2.5), (2.00014, 2.5), (2, 3)),  # not seen
                ],
                float,
            ),
            "ends": np.array([4, 8, 11]),
            "labels": np.array([0, 1, 3]),
        },
    },
    "left_out": {"embedding": "It has no layers."},
    "importance": {
        "inputs": {
            "depth": input_effect(True, 0.1, 0.2, 0.3),
            "goal": input_effect(False, 0.0, 0.001, 0.002),
        },
        "least": 0.01,
        "level": 0.001,
    },
    "asymmetry": {
        "signed": mean(-0.2, -0.3, -0.1),
        "absolute": mean(0.3, 0.2, 0.4),
        "worst": [{"frame": 7, "distance": 0.9}, {"frame": 3, "distance": 0.5}],
    },
    "data": data(),
}


STRIP = [packed(np.zeros((5, 16, 3), np.uint8))] * 6
PICTURED = changed(
    SAVED_SHIFTS,
    {"shifts.image_size": [5, 16], "shifts.pictures": dict.fromkeys(SHIFTS["axes"], STRIP)},
)
"""A robustness evaluation with camera images."""


def changed_explanation(changes=None):
    """Return the explanation with other values by path, as in "truth.outcomes.flights"."""
    return Explanation.read(changed(CONTENT, changes or {}))
