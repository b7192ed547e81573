"""Compare every file in results/ with the checksum that its job wrote."""

import sys
from pathlib import Path

from workflow import checksums, stops

log = Path(snakemake.log[0])
results = checksums.results_of(log)
found = list(checksums.verify(results))
complaints = [complaint for _, complaint in found if complaint]
words = [
    *complaints,
    f"{len(found)} files in {results}/, {len(found) - len(complaints)} of them whole",
]
log.parent.mkdir(parents=True, exist_ok=True)
log.write_text("\n".join(words) + "\n", encoding="utf-8")
print(*words, sep="\n")
if complaints:
    stops.note(f"{len(complaints)} of {len(found)} files are not what their jobs wrote")
sys.exit(bool(complaints))
