"""The failure of a command."""


class CommandError(Exception):
    """A command cannot go on; its message is the one line that the user sees."""
