"""Numbers kept in order, appended at the end and forgotten at the beginning."""

from __future__ import annotations

from typing import final

import numpy as np

from hardware.simulators.arrays import Array


@final
class GrowingTape:
    """A growing array whose old part can be forgotten; each append costs what it appends.

    Parameters
    ----------
    width : int
        Columns.
    """

    def __init__(self, width: int) -> None:
        self._data = np.empty((width, 64))
        self._begin = 0
        self._end = 0
        self.first = 0
        """Number of the first row still kept, counted from the beginning of all."""

    def __len__(self) -> int:
        """Rows kept."""
        return self._end - self._begin

    @property
    def total(self) -> int:
        """Rows ever appended."""
        return self.first + len(self)

    def append(self, *columns: Array | float) -> None:
        """Append one block for each column, all of one length."""
        size = np.size(columns[0])
        self._make_room(size)
        for row, column in zip(self._data, columns, strict=True):
            row[self._end : self._end + size] = column
        self._end += size

    def column(self, index: int, provisional: Array | None = None) -> Array:
        """Return a view of a column; `provisional` numbers stand behind it for the moment."""
        if provisional is None:
            return np.asarray(self._data[index, self._begin : self._end])
        self._make_room(provisional.size)
        end = self._end + provisional.size
        self._data[index, self._end : end] = provisional
        return np.asarray(self._data[index, self._begin : end])

    def forget(self, rows: int) -> None:
        """Forget the oldest rows."""
        rows = min(max(rows, 0), len(self))
        self._begin += rows
        self.first += rows

    def _make_room(self, size: int) -> None:
        if self._end + size <= self._data.shape[1]:
            return
        used = len(self)
        width, room = self._data.shape
        if used + size <= room - room // 4:
            self._data[:, :used] = self._data[:, self._begin : self._end].copy()
        else:
            larger = np.empty((width, (used + size) * 3 // 2 + 64))
            larger[:, :used] = self._data[:, self._begin : self._end]
            self._data = larger
        self._begin, self._end = 0, used
