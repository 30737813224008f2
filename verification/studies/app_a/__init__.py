"""Appendix A: isometric theory."""
