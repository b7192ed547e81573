"""`python -m dustfall` is the command `dustfall`."""

import sys

from dustfall.cli import main

sys.exit(main())
