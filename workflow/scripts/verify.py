"""Compare every file in results/ with the checksum that its job wrote."""

import sys

from workflow import checksums

files = complaints = 0
for _, complaint in checksums.verify():
    files += 1
    if complaint:
        complaints += 1
        print(complaint)
print(f"{files} files in {checksums.RESULTS}/, {files - complaints} of them whole")
sys.exit(min(complaints, 1))
