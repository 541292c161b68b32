"""What is not shown of a policy, and why."""

from drone_rl.explanations.report.part import Part
from drone_rl.explanations.report.text import LEFT_OUT

PART = Part(
    title="What is left out, and why",
    label="Left out",
    place=95,
    needs=("left_out",),
    words={"left_out": LEFT_OUT},
)
