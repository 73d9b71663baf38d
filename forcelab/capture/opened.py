"""What is open within a block."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TypeVar

__all__ = ["Opened"]

OpenedT = TypeVar("OpenedT", bound="Opened")


class Opened(ABC):
    """Something to open and to close: in a ``with`` statement both are done."""

    @abstractmethod
    def open(self) -> None:
        """Begin."""

    @abstractmethod
    def close(self) -> None:
        """End; closing twice is fine."""

    def __enter__(self: OpenedT) -> OpenedT:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
