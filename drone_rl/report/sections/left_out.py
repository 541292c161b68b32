"""What is not shown of a policy, and why."""

from drone_rl.report.part import Part
from drone_rl.words.report import LEFT_OUT

PART = Part(
    title="What is left out, and why",
    label="Left out",
    place=95,
    needs=("left_out",),
    words={"left_out": LEFT_OUT},
)
