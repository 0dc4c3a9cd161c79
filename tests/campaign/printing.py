"""Capture of output to descriptors 1 and 2, from Python and from libraries."""

from __future__ import annotations

import os
import sys
import tempfile
from types import TracebackType


class Printed:
    """A context that captures output to descriptors 1 and 2; afterwards it is `text`."""

    text = ""

    def __enter__(self) -> Printed:
        self._flush()
        self._kept = [os.dup(1), os.dup(2)]
        self._file = tempfile.TemporaryFile()
        for number in (1, 2):
            os.dup2(self._file.fileno(), number)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._flush()
        for number, kept in zip((1, 2), self._kept, strict=True):
            os.dup2(kept, number)
            os.close(kept)
        self._file.seek(0)
        self.text = self._file.read().decode("utf-8", errors="replace").strip()
        self._file.close()

    @staticmethod
    def _flush() -> None:
        sys.stdout.flush()
        sys.stderr.flush()
