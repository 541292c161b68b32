"""Keyword arguments of functions are the fields of their settings."""

import pytest

from drone_rl.config import (
    DynamicsSettings,
    PillarsSettings,
    TaskSettings,
    commands,
    options,
)
from drone_rl.config.training import TrainSettings
from drone_rl.explanations import settings as explaining
from drone_rl.explanations.chapter_figures import FigureOptions, FigureSettings

LEFT_OUT = {"BodiesSettings": {"policies"}, "FigureSettings": {"figure"}}
"""Fields that the functions take as arguments of their own."""


@pytest.mark.parametrize(
    ("settings", "keywords"),
    [
        (commands.EvaluateSettings, options.EvaluateOptions),
        (commands.JudgeSettings, options.JudgeOptions),
        (commands.BodiesSettings, options.BodiesOptions),
        (commands.ShiftSettings, options.ShiftOptions),
        (commands.ChanceSettings, options.ChanceOptions),
        (commands.CheckSettings, options.CheckOptions),
        (commands.PlacesSettings, options.PlacesOptions),
        (commands.ProveSettings, options.ProveOptions),
        (commands.FlySettings, options.FlyOptions),
        (commands.ServeSettings, options.ServeOptions),
        (commands.GymnasiumSettings, options.GymnasiumOptions),
        (DynamicsSettings, options.DynamicsOptions),
        (TrainSettings, options.TrainOptions),
        (explaining.ExplainSettings, explaining.ExplainOptions),
        (explaining.ClassModelsSettings, explaining.ClassModelsOptions),
        (FigureSettings, FigureOptions),
    ],
)
def test_keywords_are_the_fields_of_settings(settings, keywords):
    fields = {*settings.model_fields}
    assert keywords.__optional_keys__ == fields - LEFT_OUT.get(settings.__name__, set())


def test_keywords_of_tasks_are_the_fields_of_all_built_in_tasks():
    tasks = (TaskSettings, PillarsSettings)
    fields = {name for task in tasks for name in task.model_fields}
    assert options.TaskOptions.__optional_keys__ == fields
