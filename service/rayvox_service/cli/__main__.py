"""`python -m rayvox_service.cli` is `rayvox`."""

import sys

from rayvox_service.cli.main import main

sys.exit(main())
