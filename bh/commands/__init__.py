"""The `bh` command."""
