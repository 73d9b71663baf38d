"""What a cell of the confusion matrix holds, in a sentence; and why there is no matrix."""

from __future__ import annotations

from forcelab.gui.review.rows import as_tsv
from forcelab.review.confusion import Cells, Share, Unit, shares
from forcelab.review.run_result import Outcome

__all__ = ["as_text", "missing", "sentence"]


def sentence(cells: Cells, cell: tuple[int, int], unit: Unit, share: Share) -> str:
    """Such as ``"grab seen as hold: 12.3 s, 8 % of grab, in 5 places"``.

    Parameters
    ----------
    cells : Cells
    cell : (int, int)
        Row and column.
    unit : {"time", "segments"}
    share : {"row", "column", "counts"}
        By column, the per cent is of what was predicted.
    """
    row, column = cell
    human = cells.actions[row]
    missed = column == len(cells.actions)
    predicted = "unlabelled" if missed else cells.actions[column]
    if missed:
        what = "{0} left unlabelled"
    elif row == column:
        what = "{0} recognised"
    else:
        what = "{0} seen as {1}"
    what = what.format(human, predicted)
    matrix = cells.matrix(unit)
    if matrix[row, column] == 0:
        return f"{what}: never"
    by_column = share == "column"
    part = 100 * float(shares(matrix, "column" if by_column else "row")[row, column])
    if by_column:
        of = "{0} % of all that was seen as {1}"
        if missed:
            of = "{0} % of all that was left unlabelled"
    else:
        of = "{0} % of {2}"
    of = of.format(_percent(part), predicted, human)
    if unit == "segments":
        number = int(matrix[row, column])
        counted = "1 segment" if number == 1 else "{} segments".format(f"{number:,}")
        return f"{what}: {counted}, {of}"
    places = int(cells.numbers(unit)[row, column])
    where = "in 1 place" if places == 1 else "in {} places".format(f"{places:,}")
    return f"{what}: {matrix[row, column]:,.{_decimals(matrix[row, column])}f} s, {of}, {where}"


def missing(outcome: Outcome | None, *, opened: bool) -> str:
    """Why there is no matrix of an outcome without tested demonstrations, or of none.

    Parameters
    ----------
    outcome : Outcome or None
        What is reviewed.
    opened : bool
        Whether a project is open.
    """
    if not opened:
        return "Open a project to see which actions are confused."
    if outcome is None:
        return (
            "Nothing was trained yet. Train, and this shows which actions the recogniser "
            "confuses, and every place where it does."
        )
    return (
        "No demonstration that you may see was tested in this run: label at least two, or finish "
        "those that you code blind."
    )


def as_text(cells: Cells, unit: Unit, share: Share) -> str:
    """What the matrix shows as lines of cells with tabs between them."""
    matrix = cells.matrix(unit)
    shown = matrix if share == "counts" else shares(matrix, share)
    decimals = 4 if share != "counts" else 3 if unit == "time" else 0
    lines = [["", *cells.actions, "unlabelled"]]
    lines += [
        [action, *(f"{value:.{decimals}f}" for value in row)]
        for action, row in zip(cells.actions, shown.tolist(), strict=True)
    ]
    return as_tsv(lines)


def _decimals(seconds: float) -> int:
    """A tenth of a second is enough, unless there is less than one."""
    return 1 if seconds >= 1 else 3


def _percent(part: float) -> str:
    """Whole per cents, tenths where there is less than one, and never 0 of something."""
    if part >= 1:
        return f"{part:.0f}"
    return f"{part:.1f}" if part >= 0.1 else "< 0.1"
