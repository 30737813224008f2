"""The verification report: one self-contained HTML page, made from stored results; nothing is solved here."""
