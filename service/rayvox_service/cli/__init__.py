"""The command line: `rayvox serve | upload | export | info | tune | demo`."""
