"""What was recorded."""

from drone_rl.explanations.report.part import Part
from drone_rl.explanations.report.text import DATASET

PART = Part(
    title="What was recorded",
    label="Recorded",
    place=20,
    needs=("dataset",),
    words={"dataset": DATASET},
)
