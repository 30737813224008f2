"""What both formulations of bars and hinges share: kinematics, assembly, supports, symmetry, locks and contact."""
