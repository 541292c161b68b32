"""Networks of a user's own that look like the built-in ones and compute something else."""

from torch import nn

from drone_rl.policies import SmallCNN


class Mirrored(SmallCNN):
    """Flips its frames."""

    def forward(self, pixels):
        return super().forward(pixels.flip(-1))


class Doubled(nn.Conv2d):
    """A convolution that returns twice its values."""

    def forward(self, input):
        return 2 * super().forward(input)
