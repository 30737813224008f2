"""The driver and what it needs: it knows systems only, neither sheets nor formulations."""
