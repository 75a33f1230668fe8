"""What is kept on disk to save time."""

from __future__ import annotations

from collections import defaultdict
from contextlib import suppress

from hotlever.tasks.reporter import Reporter


def show_cache(
    reporter: Reporter,
    *,
    clear: bool = False,
) -> None:
    """Show what is kept on disk to save time: reduced levers, operators of the air, states.

    Parameters
    ----------
    clear
        Remove all that is kept.
    """
    from hotlever.cache import CACHE_VARIABLE, cache_folder, kept_files, largest_size

    folder = cache_folder()
    if folder is None:
        reporter.give(f"the cache is switched off: {CACHE_VARIABLE} is empty\n")
        return
    if clear:
        for _, path in kept_files(folder):
            with suppress(OSError):
                path.unlink()
    files = kept_files(folder)
    sizes: dict[str, list[int]] = defaultdict(list)
    for status, path in files:
        sizes[path.parent.name].append(status.st_size)
    sizes["in all"] = [status.st_size for status, _ in files]
    lines = [f"{folder} (at most {largest_size() / 1e9:g} GB)"]
    for kind, bytes_of in sizes.items():
        lines.append(f"{kind:<10} {len(bytes_of):>6} files {sum(bytes_of) / 1e6:>10.1f} MB")
    reporter.give("\n".join([*lines, ""]))
