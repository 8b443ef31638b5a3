"""The command line: `rayvox serve | upload | export | info | demo`."""
