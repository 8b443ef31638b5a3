"""rayvox's HTTP and WebSocket service: one journaled occupancy map per name."""

__version__ = "0.1.0"
