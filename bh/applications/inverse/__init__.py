"""Inverse design: creases whose pinched segments meet a target (source Ch. 6)."""
