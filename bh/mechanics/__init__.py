"""The two formulations of bars and hinges, each in a folder, and what they share."""
