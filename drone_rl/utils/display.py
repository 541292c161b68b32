"""Tables and figures of results: as text for a terminal, as HTML for a notebook."""

import base64
import html
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def aligned(rows: Sequence[Sequence[str]], *, are_numbers: bool = False) -> str:
    """A table as text, each column as wide as its longest cell.

    Args:
        rows: Texts, as many in each row as there are columns.
        are_numbers: Whether cells stand at the right, but for those of the first column.
    """
    rest = str.rjust if are_numbers else str.ljust
    first, *others = (2 + max(map(len, column)) for column in zip(*rows, strict=True))
    lines = (row[0].ljust(first) + "".join(map(rest, row[1:], others)) for row in rows)
    return "\n".join(line.rstrip() for line in lines)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; every text is escaped.

    Args:
        head: Of the columns.
        rows: Texts, as many as there are columns.
    """
    cells = "".join(f"<th>{html.escape(text)}</th>" for text in head)
    lines = "".join(
        f"<tr>{''.join(f'<td>{html.escape(text)}</td>' for text in row)}</tr>" for row in rows
    )
    return f"<table><thead><tr>{cells}</tr></thead><tbody>{lines}</tbody></table>"


def paragraph(text: str) -> str:
    """A paragraph, escaped."""
    return f"<p>{html.escape(text)}</p>"


def picture(figure: "Figure") -> str:
    """A figure as an image that needs no file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=90)
    return f'<img src="data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}">'


def page(document: str, height: int = 800) -> str:
    """A whole HTML page inside another one, where its style and scripts touch nothing else.

    Its scripts run in an origin of their own, so that they can't reach the notebook.
    """
    return (
        f'<iframe sandbox="allow-scripts" srcdoc="{html.escape(document)}" '
        f'style="width: 100%; height: {height}px; border: 0"></iframe>'
    )


def interval(figure: Mapping[str, Any], key: str) -> str:
    """A rate and its 95% interval in percent.

    Args:
        figure: With the rate, None of nothing, "lower95" and "upper95".
        key: Of the rate.
    """
    if figure[key] is None:
        return "not offered"
    share, low, high = (f"{100 * figure[k]:.3g}" for k in (key, "lower95", "upper95"))
    return f"{share}% [{low}, {high}]"
