"""`python -m profilebench`."""

import sys

from .cli import main

sys.exit(main())
