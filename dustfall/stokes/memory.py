"""What a scene may take of the memory that there is."""

import os


def check_memory(n: int, needed: int) -> None:
    """Raise MemoryError, with both sizes, where that many bytes are more than there are."""
    there = available_memory()
    if needed > there:
        raise MemoryError(
            f"{n} spheres take {needed / 2**30:.1f} GiB at this tolerance: only "
            f"{there / 2**30:.1f} GiB of memory are available"
        )


def available_memory() -> int:
    """Bytes that this machine can still give, its whole memory where it does not tell."""
    try:
        with open("/proc/meminfo", encoding="ascii") as lines:
            for line in lines:
                if line.startswith("MemAvailable:"):
                    return 1024 * int(line.split()[1])
    except OSError:
        pass
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
