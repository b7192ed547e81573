"""One thread for every numerical library, before the first of them is imported."""

import os

for library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")


def pytest_collection_modifyitems(items):
    """Put the campaign first: where several processes share the files it would end last."""
    items.sort(key=lambda item: item.path.name != "test_campaign.py")
