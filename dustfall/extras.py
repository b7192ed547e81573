"""Packages that only some rooms of the library need, and how one gets them."""

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def extra(name: str) -> Iterator[None]:
    """Say of an import inside which extra of pyproject.toml brings what is missing.

    Raises ModuleNotFoundError with one sentence in place of the bare one.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{error.name} is not installed; it comes by: pip install 'dustfall[{name}]'",
            name=error.name,
        ) from None
