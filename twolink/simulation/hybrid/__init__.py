"""The hybrid simulator: smooth flow inside a mode, and jumps between modes."""
