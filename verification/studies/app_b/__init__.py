"""Appendix B: shell finite elements."""
