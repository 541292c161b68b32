"""Save images, videos, tables and numbers as files and data URIs."""

import base64
import io
from pathlib import Path

import imageio.v3 as iio
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

_DPI = 90
"""Pixels per inch of a chart."""
_MAX_PIXELS = 2**25
"""Largest number of pixels of a chart."""
FRAMES_PER_SECOND = 8
"""Frame rate of videos."""


def new_chart(width: float = 4.5, height: float = 3.2) -> tuple[Figure, Axes]:
    """Return a chart of one panel. Sizes are in inches; the default is legible on a phone."""
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots()


def save_drawn(drawn: Image.Image | Figure | NDArray, path: Path) -> str:
    """Save an image as PNG, a chart as PNG and SVG, a video as MP4; return it as a data URI.

    The path is without suffix. See `drone_rl.explanations.report.part.Media`. Raises a
    `ValueError` for a chart that is too large.
    """
    if isinstance(drawn, (Image.Image, Figure)):
        if isinstance(drawn, Figure):
            _lay_out(drawn)
        content = to_png(drawn)
        path.with_name(path.name + ".png").write_bytes(content)
        if isinstance(drawn, Image.Image):
            return to_uri(content, "image/png")
        content = _to_svg(drawn)
        path.with_name(path.name + ".svg").write_bytes(content)
        return to_uri(content, "image/svg+xml")
    film = path.with_name(path.name + ".mp4")
    iio.imwrite(film, drawn, fps=FRAMES_PER_SECOND, codec="libx264")
    return to_uri(film.read_bytes(), "video/mp4")


def to_png(drawn: Image.Image | Figure) -> bytes:
    """Encode an image or chart as PNG.

    Raises:
        ValueError: The chart is too large.
    """
    buffer = io.BytesIO()
    if isinstance(drawn, Figure):
        width, height = (_DPI * drawn.get_size_inches()).tolist()
        if not width * height <= _MAX_PIXELS:  # nor if a size is NaN
            raise ValueError(
                f"a chart has {width:.0f} x {height:.0f} pixels; at most {_MAX_PIXELS} fit"
            )
        drawn.savefig(buffer, format="png", dpi=_DPI, metadata={"Software": None})
    else:
        drawn.save(buffer, "png", optimize=True)
    return buffer.getvalue()


def _lay_out(figure: Figure) -> None:
    """Lay out a chart once; otherwise matplotlib does so, and draws it twice, for each format."""
    engine = figure.get_layout_engine()
    if engine is not None:
        figure.set_dpi(_DPI)
        engine.execute(figure)
        figure.set_layout_engine(None)


def _to_svg(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    with rc_context({"svg.hashsalt": "drone_rl"}):  # the same SVG of the same chart
        figure.savefig(buffer, format="svg", dpi=2 * _DPI, metadata={"Date": None})
    return buffer.getvalue()


def to_uri(content: bytes, kind: str) -> str:
    """Encode bytes of a media type, such as image/png, as a data URI."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
